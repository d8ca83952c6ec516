"""Odd lines: IPv6 alone, small packets, a peer that vanishes, a certificate that expires."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from channel.links.endpoints import free_endpoint
from channel.links.zenoh.config import LEASE_MS
from tenbaud.flight.outcome import ExitCode
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority
from tenbaud.recording.reader import Recording
from tests.network.flights import (
    DESK_AT,
    RIG_AT,
    Flight,
    environment,
    make_keys,
    tls_links,
    two_machines,
)
from tests.network.namespaces import Lab, Machine
from tests.tenbaud.confirmed import check_flown
from tests.tenbaud.ends import PATIENCE_S, End

TENBAUD = (sys.executable, "-m", "tenbaud")


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    with Lab() as made:
        yield made


def _with_ipv6_alone(lab: Lab) -> Machine:
    machine = lab.machine("six")
    machine.ip("addr", "del", "127.0.0.1/8", "dev", "lo")
    return machine


def test_on_a_machine_with_ipv6_alone_both_ends_meet(lab: Lab, tmp_path: Path) -> None:
    six = _with_ipv6_alone(lab)
    flight = ("demo", "--mismatch", "0", "--duration", "2", "--json", "--out", str(tmp_path / "demo"))
    done = six.run(*TENBAUD, *flight, "--view", "--view-port", "0", timeout_s=60.0)
    assert done.returncode == 0, done.stderr
    assert "http://[::1]:" in done.stderr
    desk = End("receive", [], tmp_path / "desk", prefix=six.prefix, draws=False)
    shown = ["--telemetry", "tcp/[::1]:7448", "--duration", "2"]
    rig = End("transmit", [], tmp_path / "rig", *shown, prefix=six.prefix, draws=False)
    (rig_code, upper), (desk_code, _) = rig.ended(), desk.ended()
    assert (rig_code, desk_code) == (0, 0), rig.said + desk.said
    assert upper["telemetry"] == "on"


@pytest.mark.parametrize("mtu", [pytest.param(1280, marks=pytest.mark.soak), 576])
def test_packets_may_be_small(lab: Lab, tmp_path: Path, mtu: int) -> None:
    rig, desk = two_machines(lab)
    for plug in lab.cable(rig, RIG_AT, desk, DESK_AT):
        plug.machine.ip("link", "set", plug.device, "mtu", str(mtu))
    with Flight(tmp_path, rig, desk, **tls_links(make_keys(tmp_path)), duration_s=3.0) as flight:
        upper, lower = flight.ended()
    check_flown(upper, 30, lower)
    assert lower["desyncs"] == 0


def test_a_peer_that_vanishes_without_a_word_is_noticed_within_the_lease(
    lab: Lab, tmp_path: Path
) -> None:
    rig, desk = two_machines(lab)
    cable = lab.bad_cable(rig, RIG_AT, desk, DESK_AT, delay_s=0.0, loss=0.0)
    links = tls_links(make_keys(tmp_path))
    # Patience alone would end the flight too, much later than the lease.
    patience = ("--set", f"link.peer_timeout_s={10 * LEASE_MS / 1e3:g}")
    with Flight(tmp_path, rig, desk, **links, duration_s=60.0, settings=patience) as flight:
        flight.wait_until_flying()
        # From here on every packet is dropped, those that would end the connection included.
        cable.loss = 1.0
        (rig_code, _), (desk_code, _) = flight.rig.ended(), flight.desk.ended()
    assert rig_code == desk_code == ExitCode.LINK_LOST, flight.rig.said + flight.desk.said
    recording = Recording(tmp_path / "rig" / "transmitter.mcap")
    events = [(time_ns / 1e9, row) for time_ns, row in recording.rows("event")]
    ticks = [row for _, row in recording.rows("tick")]
    heard_s = max(row["tick"] for row in ticks if row["commanded"] is not None) * 0.01
    gone = [
        at for at, row in events if (row["kind"], row["cause"]) == ("peer", "gone") and at >= heard_s
    ]
    assert gone
    # A busy machine looks at the lease late.
    assert gone[0] - heard_s < 3 * LEASE_MS / 1e3
    # Hold, ramp, safe: 0.5 s by the clock, then 100 steps; a loop that misses ticks takes longer.
    late = [row["applied"] for row in ticks if row["tick"] * 0.01 > heard_s + 0.5][102:]
    assert late
    assert all(volts == [0.0, 0.0] for volts in late)


@pytest.mark.parametrize("expiring", ["rig", "desk"])
def test_a_certificate_that_expires_in_flight_ends_it_and_is_named(
    expiring: str, tmp_path: Path
) -> None:
    # A busy machine may take longer to start both ends than a certificate lasts.
    for lifetime_s in (12.0, 30.0, 90.0):
        folder = tmp_path / f"{lifetime_s:g}"
        folder.mkdir()
        if _expires_in_flight(expiring, folder, lifetime_s):
            return
    raise AssertionError("the ends did not meet before the certificate expired")


def _expires_in_flight(expiring: str, tmp_path: Path, lifetime_s: float) -> bool:
    """Fly with a certificate of this lifetime; False where it expired before the flight had begun."""
    keys = tmp_path / "keys"
    create_authority(keys)
    days = {"rig": 1.0, "desk": 1.0, expiring: lifetime_s / 86_400.0}
    add_node(keys, "rig", NodeRole.TRANSMITTER, (), days["rig"])
    add_node(keys, "desk", NodeRole.RECEIVER, ("127.0.0.1",), days["desk"])
    at = free_endpoint().replace("tcp/", "tls/")
    common = ("--set", "link.peer_timeout_s=4")
    desk_link = ["--keys", str(keys / "desk"), "--peer", "rig", "--listen", at]
    rig_link = ["--keys", str(keys / "rig"), "--peer", "desk", "--connect", at]
    desk = End("receive", desk_link, tmp_path / "desk", *common, draws=False)
    rig = End("transmit", rig_link, tmp_path / "rig", *common, "--duration", "600", draws=False)
    try:
        if not _both_fly(rig, desk):
            return False
        codes = {"rig": rig.ended()[0], "desk": desk.ended()[0]}
    finally:
        for end in (rig, desk):
            if end.process.poll() is None:
                end.kill()
    assert codes == {"rig": 4, "desk": 4}
    said = {"rig": rig.said[-1], "desk": desk.said[-1]}
    assert f"the certificate of {expiring} expired in flight" in said[expiring]
    ticks = [row for _, row in Recording(tmp_path / "rig" / "transmitter.mcap").rows("tick")]
    assert ticks[-1]["applied"] == [0.0, 0.0]
    return True


def _both_fly(rig: End, desk: End) -> bool:
    """Wait until both fly; False where one has ended without having flown."""
    until = time.monotonic() + PATIENCE_S
    while not (rig.flies and desk.flies):
        assert time.monotonic() < until, rig.said + desk.said
        if rig.process.poll() is not None or desk.process.poll() is not None:
            return False
        time.sleep(0.05)
    return True
