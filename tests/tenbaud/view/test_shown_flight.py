"""`fly(show=True)` in a script: the live page of a flight of objects, in a real browser."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.browser import browser, served, state_is, why_no_browser
from tenbaud import Run, errors, fly
from tenbaud.recording.writer import McapRecorder

PROGRAM = """
from tenbaud import errors, fly
from tenbaud.plants import PitchParameters, PitchPlant

plant = PitchPlant(PitchParameters().mismatched(0.1), 0.01)
try:
    fly("tuned-10baud", plant=plant, settings={"duration_s": 3600.0}, out="run", show=True)
except errors.FlightFailed as error:
    print(error)
"""


@pytest.mark.skipif(why_no_browser() is not None, reason=str(why_no_browser()))
def test_a_flight_of_objects_opens_its_page_and_obeys_it(tmp_path: Path) -> None:
    opener = tmp_path / "opener"
    opener.write_text(f'#!/bin/sh\necho "$1" > {tmp_path}/opened\n')
    opener.chmod(0o755)
    opened = {"BROWSER": str(opener)}
    with (
        served(tmp_path, "-c", PROGRAM, program=(), environment=opened) as flight,
        browser() as chromium,
    ):
        page = chromium.new_page()
        page.goto(flight.url)
        state_is(page, "lockstep", 60.0)
        page.get_by_role("button", name="Corrupt the receiver's codec").click()
        state_is(page, "broken", 60.0)
        assert "interrupted" in flight.stop() or flight.process.returncode == 0
    assert (tmp_path / "opened").read_text().startswith("file://")
    run = Run(tmp_path / "run")
    assert run.summary["desyncs"] == 1
    kinds = {(event["kind"], event["end"]) for event in run.events}
    assert {("control", "receiver"), ("desync", "transmitter")} <= kinds


def test_a_pace_is_for_the_virtual_clock_and_above_zero(tmp_path: Path) -> None:
    for wrong in ({"pace": 0.0}, {"pace": 1.0, "clock": "real", "link": "zenoh"}):
        with pytest.raises(errors.ConfigError, match="pace slows the virtual clock down"):
            fly("tuned-10baud", out=tmp_path / "run", **wrong)  # type: ignore[arg-type]
        assert not (tmp_path / "run").exists()


def test_a_flight_that_failed_gives_its_run(tmp_path: Path) -> None:
    low = {"duration_s": 5.0, "link.impairments": "up:loss=0.97"}
    with pytest.raises(errors.FlightFailed) as failed:
        fly("tuned-10baud", settings=low, out=tmp_path / "run")
    run = failed.value.run
    assert run is not None
    assert run.summary["not_flown"]
    assert str(failed.value).count(run.summary["outcome"]) == 1


def test_a_flight_that_failed_without_a_recording_keeps_its_cause(tmp_path: Path) -> None:
    failed = errors.FlightFailed("the device is gone", tmp_path)
    assert failed.run is None
    assert "the device is gone" in str(failed)
    assert str(tmp_path) in str(failed)


def test_a_recording_without_a_tick_has_a_repr(tmp_path: Path) -> None:
    flown = fly("tuned-10baud", settings={"duration_s": 1.0}, out=tmp_path / "run")
    folder = tmp_path / "begun"
    folder.mkdir()
    with McapRecorder(folder / flown.folder.transmitter.name, flown.metadata):
        pass
    assert "no ticks" in repr(Run(folder))
