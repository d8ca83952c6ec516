"""Flights between two machines: over TLS, on a slow line, a bad one, and one that is pulled out."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.network.flights import DESK_AT, RIG_AT, Flight, at, make_keys, tls_links, two_machines
from tests.network.namespaces import Lab
from tests.tenbaud.confirmed import PATIENT, check_flown

OTHER_RIG_AT, OTHER_DESK_AT = "10.77.1.31", "10.77.1.32"
PULLED_S = 5.0


@pytest.fixture
def lab() -> Iterator[Lab]:
    with Lab() as made:
        yield made


def test_a_flight_over_tls_on_a_line_of_limited_rate(lab: Lab, tmp_path: Path) -> None:
    rig, desk = two_machines(lab)
    plugs = lab.cable(rig, RIG_AT, desk, DESK_AT)
    for plug in plugs:
        plug.limit("rate", "64kbit", "burst", "4kb", "latency", "400ms")
    with Flight(tmp_path, rig, desk, **tls_links(make_keys(tmp_path)), duration_s=4.0) as flight:
        upper, lower = flight.ended()
    check_flown(upper, 40, lower)
    assert lower["desyncs"] == 0
    assert upper["connections_refused"] == lower["connections_refused"] == {}
    assert all(plug.limited_bytes() > 1000 for plug in plugs), "the flight went another way"


def test_a_flight_over_a_line_with_delay_and_loss(lab: Lab, tmp_path: Path) -> None:
    rig, desk = two_machines(lab)
    cable = lab.bad_cable(rig, RIG_AT, desk, DESK_AT, delay_s=0.02, loss=0.05)
    budget = (
        "--set",
        "channel.deadline_allowance_s=0.1",
        "--set",
        "channel.downlink_budget_s=0.1",
        *PATIENT,
    )
    links = tls_links(make_keys(tmp_path))
    with Flight(tmp_path, rig, desk, **links, duration_s=6.0, settings=budget) as flight:
        upper, _ = flight.ended()
    assert cable.lost > 0
    assert upper["digest_checks"] >= 50
    assert upper["desyncs"] == 0


def test_the_cable_is_pulled_for_five_seconds_and_put_back(lab: Lab, tmp_path: Path) -> None:
    rig, desk = two_machines(lab)
    plug, _ = lab.cable(rig, RIG_AT, desk, DESK_AT)
    with Flight(tmp_path, rig, desk, **tls_links(make_keys(tmp_path)), settings=()) as flight:
        flight.wait_until_flying()
        plug.pull()
        time.sleep(PULLED_S)
        assert not flight.rig.flies, "the flight did not notice that its cable was gone"
        plug.put_back()
        flight.wait_until_flying()
        upper, lower = flight.stopped()
    assert upper["rejoins"] >= 1
    assert upper["guard_rearmed"] >= 1
    assert upper["desyncs"] == lower["desyncs"] == 0


@pytest.mark.soak
def test_both_machines_get_another_address(lab: Lab, tmp_path: Path) -> None:
    rig, desk = two_machines(lab)
    rig_plug, desk_plug = lab.cable(rig, RIG_AT, desk, DESK_AT)
    keys = make_keys(tmp_path, (DESK_AT, OTHER_DESK_AT))
    links = tls_links(keys)
    links["rig_link"] += ["--connect", at(OTHER_DESK_AT)]
    with Flight(tmp_path, rig, desk, **links, settings=()) as flight:
        flight.wait_until_flying()
        for plug, old, new in (
            (rig_plug, RIG_AT, OTHER_RIG_AT),
            (desk_plug, DESK_AT, OTHER_DESK_AT),
        ):
            plug.readdress(old, new)
            time.sleep(1.0)
            flight.wait_until_flying()
        upper, _ = flight.stopped()
    assert upper["rejoins"] >= 2
    assert upper["desyncs"] == 0


def test_the_ends_find_each_other_by_scouting(lab: Lab, tmp_path: Path) -> None:
    rig, desk = two_machines(lab)
    for plug in lab.cable(rig, RIG_AT, desk, DESK_AT):
        plug.machine.ip("route", "add", "224.0.0.0/4", "dev", plug.device)
    keys = make_keys(tmp_path)
    links = {
        "rig_link": ["--keys", str(keys / "rig"), "--peer", "desk", "--scout"],
        "desk_link": [
            "--keys",
            str(keys / "desk"),
            "--peer",
            "rig",
            "--listen",
            at(DESK_AT),
            "--scout",
        ],
    }
    with Flight(tmp_path, rig, desk, **links, duration_s=2.0) as flight:
        upper, lower = flight.ended()
    check_flown(upper, 20, lower)
