"""The pages are followed to the letter, on machines made of namespaces."""

from __future__ import annotations

import json
from pathlib import Path

import zenoh

from tests.docs.blocks import blocks_of
from tests.network.namespaces import Lab
from tests.network.pages import run_page
from tests.tenbaud.confirmed import check_flown


def summaries(folder: Path) -> list[dict[str, object]]:
    return [json.loads(path.read_text()) for path in sorted(folder.glob("homes/*/runs/*/summary.json"))]


def check_pages_flight(folder: Path) -> None:
    flights = summaries(folder)
    assert len(flights) == 2
    for flight in flights:
        assert flight["exit_code"] == 0
        assert flight["desyncs"] == 0
        assert flight["samples"] >= 50
    rig, desk = sorted(flights, key=lambda flight: "digest_checks" not in flight)
    check_flown(rig, 50, desk)


def test_two_machines_fly_as_the_page_says(tmp_path: Path) -> None:
    with Lab() as lab:
        rig, desk = lab.machine("rig"), lab.machine("desk")
        lab.cable(rig, "10.0.0.1", desk, "10.0.0.2")
        ran = run_page("docs/two-machines.md", {"rig": rig, "desk": desk}, tmp_path)
    check_pages_flight(tmp_path)
    commands = next(said for said in ran.said if "keys/rig: rig" in said)
    for block in blocks_of("docs/two-machines.md"):
        if "--listen" in block.text:
            assert block.text.strip() in commands, "`keys add` prints another command than the page"


def test_a_router_joins_two_machines_as_the_page_says(tmp_path: Path) -> None:
    with Lab() as lab:
        rig, desk, hub = (lab.machine(name) for name in ("rig", "desk", "hub"))
        lab.cable(rig, "10.0.1.1", hub, "10.0.1.9")
        lab.cable(desk, "10.0.2.2", hub, "10.0.2.9")
        ran = run_page("docs/router.md", {"rig": rig, "desk": desk, "hub": hub}, tmp_path)
    check_pages_flight(tmp_path)
    assert any("2 connected" in said and "connections refused: none" in said for said in ran.said)
    config = zenoh.Config.from_file(str(tmp_path / "homes" / "hub" / "zenohd.json5"))
    access = json.loads(config.get_json("access_control"))
    assert access["default_permission"] == "deny"
    assert {one["cert_common_names"][0] for one in access["subjects"]} == {"rig", "desk"}
