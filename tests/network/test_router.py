"""A router between two machines that cannot reach each other, and a flight that changes hands there."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node
from tests.network.flights import Flight, at, environment, make_keys
from tests.network.namespaces import Lab, Machine
from tests.tenbaud.ends import End, wait_for

RIG_SIDE, DESK_SIDE, SPARE_SIDE = "10.77.1.9", "10.77.2.9", "10.77.3.9"


@contextmanager
def running_router(hub: Machine, keys: Path, receivers: str) -> Iterator[None]:
    command = [sys.executable, "-m", "tenbaud", "router", "--keys", str(keys / "hub")]
    command += ["--listen", "tls/0.0.0.0:7447"]
    for receiver in receivers.split(","):
        command += ["--flight", f"helicopter=rig,{receiver}"]
    process = subprocess.Popen(
        [*hub.prefix, *command],
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    try:
        assert "tenbaud router at" in process.stderr.readline()
        yield
    finally:
        process.send_signal(signal.SIGINT)
        try:
            said = process.communicate(timeout=60.0)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    assert "connections refused: none" in said


def behind(keys: Path, name: str, side: str) -> list[str]:
    return ["--keys", str(keys / name), "--peer", "hub", "--router", at(side)]


def test_a_flight_through_a_router_survives_its_restart_and_changes_hands(tmp_path: Path) -> None:
    keys = make_keys(tmp_path)
    add_node(keys, "hub", NodeRole.ROUTER, (RIG_SIDE, DESK_SIDE, SPARE_SIDE))
    add_node(keys, "spare", NodeRole.RECEIVER, ("10.77.3.2",))
    with Lab() as lab:
        rig, desk, spare, hub = (lab.machine(name) for name in ("rig", "desk", "spare", "hub"))
        lab.cable(rig, "10.77.1.1", hub, RIG_SIDE)
        lab.cable(desk, "10.77.2.2", hub, DESK_SIDE)
        lab.cable(spare, "10.77.3.2", hub, SPARE_SIDE)
        assert rig.run("ip", "route", "get", "10.77.2.2").returncode != 0, "they can reach each other"
        links = {
            "rig_link": behind(keys, "rig", RIG_SIDE),
            "desk_link": behind(keys, "desk", DESK_SIDE),
        }
        # The ends start before the router and wait for it.
        with Flight(tmp_path, rig, desk, **links) as flight:
            with running_router(hub, keys, "desk,spare"):
                flight.wait_until_flying()
            time.sleep(1.0)
            with running_router(hub, keys, "desk,spare"):
                flight.wait_until_flying()
                _change_hands(flight, spare, behind(keys, "spare", SPARE_SIDE), tmp_path)


def _change_hands(flight: Flight, machine: Machine, link: list[str], folder: Path) -> None:
    """A second receiver is refused, and the same one takes over with `--take-over`."""
    second = End("receive", link, folder / "second", prefix=machine.prefix, draws=False)
    code, _ = second.ended()
    assert code == 4
    assert any("flies with another receiver" in line for line in second.said), second.said
    flight.wait_until_flying()
    third = End("receive", link, folder / "third", "--take-over", prefix=machine.prefix, draws=False)
    try:
        wait_for(lambda: third.flies and flight.rig.flies, lambda: f"{third.status} {third.said}")
        code, lower = flight.desk.ended()
        assert code == 4
        assert "another receiver has taken the flight over" in lower["outcome"]
        _, upper = flight.rig.stop_politely()
        third.ended()
    finally:
        if third.process.poll() is None:
            third.kill()
    assert upper["claims_refused"] >= 1
    assert upper["take_overs"] == 1
    assert upper["rejoins"] >= 2
    assert upper["desyncs"] == 0
