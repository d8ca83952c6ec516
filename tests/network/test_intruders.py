"""Nodes without an invitation are refused and counted, and the flight does not notice."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tenbaud.keys.authority import NodeRole, issue, new_authority
from tenbaud.keys.store import read_authority, read_node
from tests.network.flights import DESK_AT, RIG_AT, Flight, environment, make_keys, tls_links
from tests.network.namespaces import Lab, Machine
from tests.tenbaud.processes import REPOSITORY

OUTSIDE, DESK_OUTSIDE = "10.77.2.1", "10.77.2.2"
ATTEMPTS = 20
ATTEMPTS_PER_S = 8
"""Zenoh takes a tenth of a second's rest after a failed handshake; more than that would queue up."""
LATENESS_FLOOR_MS = 0.5
"""Below this, lateness is the machine's own noise."""


def intrude(machine: Machine, *arguments: str, timeout_s: float = 60.0) -> dict[str, Any]:
    done = subprocess.run(
        [*machine.prefix, sys.executable, "-m", "tests.network.intruder", *arguments],
        env=environment(),
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def odd_certificates(keys: Path, folder: Path) -> dict[str, tuple[str, str]]:
    """Make a certificate of another authority and an expired one of ours, both named rig."""
    made = {
        "foreign": issue(new_authority("another"), "rig", NodeRole.TRANSMITTER, ()),
        "expired": issue(read_authority(keys), "rig", NodeRole.TRANSMITTER, (), days=-1.0),
    }
    paths = {}
    for name, pem in made.items():
        certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
        certificate.write_bytes(pem.certificate)
        key.write_bytes(pem.private_key)
        paths[name] = (str(certificate), str(key))
    return paths


@contextmanager
def watched_flight(folder: Path) -> Iterator[tuple[Flight, Machine, Path]]:
    """Within the `with`, a flight and a machine from which it can be reached by others."""
    keys = make_keys(folder, (DESK_AT, DESK_OUTSIDE))
    with Lab() as lab:
        rig, desk, outside = (lab.machine(name) for name in ("rig", "desk", "out"))
        lab.cable(rig, RIG_AT, desk, DESK_AT)
        lab.cable(outside, OUTSIDE, desk, DESK_OUTSIDE)
        with Flight(folder, rig, desk, **tls_links(keys)) as flight:
            flight.wait_until_flying()
            yield flight, outside, keys


def check_undisturbed(upper: dict[str, Any], lower: dict[str, Any]) -> None:
    assert upper["rejoins"] == upper["desyncs"] == upper["guard_rearmed"] == 0
    assert upper["digest_checks"] > 0
    assert lower["desyncs"] == lower["stale_frames"] == lower["malformed"] == 0


def test_intruders_are_refused_and_counted_and_the_flight_goes_on(tmp_path: Path) -> None:
    with watched_flight(tmp_path) as (flight, outside, keys):
        odd = odd_certificates(keys, tmp_path)
        assert intrude(outside, "handshake", DESK_OUTSIDE, "-", "-")["refused"]
        assert intrude(outside, "handshake", DESK_OUTSIDE, *odd["foreign"])["refused"]
        assert intrude(outside, "handshake", DESK_OUTSIDE, *odd["expired"])["refused"]
        own = read_node(keys / "rig").credentials
        pair = str(own.certificate), str(own.private_key)
        assert not intrude(outside, "handshake", DESK_OUTSIDE, *pair)["refused"], "refuses everybody"
        insider = intrude(outside, "insider", DESK_OUTSIDE, str(keys / "intern"), "rig", "desk")
        assert insider == {"heard": 0, "saw_a_peer": False}
        garbage = intrude(outside, "garbage", DESK_OUTSIDE, str(ATTEMPTS), str(ATTEMPTS_PER_S))
        assert garbage["reached"] == ATTEMPTS
        time.sleep(1.0)
        flight.wait_until_flying()
        upper, lower = flight.stopped()
    check_undisturbed(upper, lower)
    refused = lower["connections_refused"]
    assert refused["no certificate"] == 1
    assert refused["another authority's certificate"] == 1
    assert refused["expired certificate"] == 1
    assert refused["uninvited certificate intern"] == 2
    assert refused["no TLS"] == ATTEMPTS
    assert any("turned a connection away: no TLS (10 so far)" in line for line in flight.desk.said)


def test_a_silent_connection_keeps_nobody_out(tmp_path: Path) -> None:
    with watched_flight(tmp_path) as (flight, outside, _):
        deed = "import socket, time; held = [socket.create_connection((%r, 7447)) for _ in range(20)]"
        command = [sys.executable, "-c", deed % DESK_OUTSIDE + "; time.sleep(60)"]
        holding = subprocess.Popen([*outside.prefix, *command])
        try:
            time.sleep(1.0)
            flight.wait_until_flying()
        finally:
            holding.kill()
            holding.wait()
        upper, _ = flight.stopped()
    assert upper["rejoins"] == 0


def flown_under(attempts: int, seconds: float, folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fly so long while somebody tries to get in so often; return both summaries."""
    folder.mkdir()
    with watched_flight(folder) as (flight, outside, _):
        if attempts:
            arguments = ("garbage", DESK_OUTSIDE, str(attempts), str(attempts / seconds))
            assert intrude(outside, *arguments, timeout_s=2.0 * seconds)["reached"] == attempts
            time.sleep(2.0)
        else:
            time.sleep(seconds)
        flight.wait_until_flying()
        upper, lower = flight.stopped()
    check_undisturbed(upper, lower)
    assert sum(lower["connections_refused"].values()) == attempts
    return upper, lower


@pytest.mark.soak
def test_ten_thousand_attempts_at_a_bounded_rate(tmp_path: Path) -> None:
    attempts = 10_000
    quiet, _ = flown_under(0, 120.0, tmp_path / "quiet")
    attacked, _ = flown_under(attempts, attempts / ATTEMPTS_PER_S, tmp_path / "attacked")
    lateness = quiet["loop_late_ms_p99"], attacked["loop_late_ms_p99"]
    print(f"loop lateness p99: quiet {lateness[0]:.3f} ms, attacked {lateness[1]:.3f} ms")
    assert lateness[1] <= 2.0 * max(lateness[0], LATENESS_FLOOR_MS)
