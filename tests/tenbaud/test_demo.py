"""The demo as a newcomer runs it: two processes, Zenoh on loopback, a folder with everything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from docs.tools.summary_page import FIELDS, SOMETIMES
from tenbaud import fly
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight.usual import usual_flight
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.reader import MessageStream, rows_in_blocks
from tenbaud.studies.plain import fly_plain
from tests.tenbaud.confirmed import PATIENT, check_flown, need_idle
from tests.tenbaud.machine import Pacer
from tests.tenbaud.processes import run

REAL_FLIGHT = Path(__file__).parents[3] / "shared" / "data" / "uiuc_closed_loop.csv"


def test_when_the_demo_flies_the_paper_then_every_sample_is_checked(tmp_path: Path) -> None:
    paper = ("--preset", "paper-10baud", "--mismatch", "0.1", "--duration", "60")
    ended = run("demo", "--json", "--figure", *paper, "--out", "run", cwd=tmp_path)
    assert ended.code == 0, ended.err
    summary = ended.summary
    documented = {name.partition(".")[0] for name in FIELDS}
    assert documented - SOMETIMES <= summary.keys() <= documented
    of_output = {f"outputs.NAME.{name}" for name in summary["outputs"]["pitch"]}
    assert of_output == {name for name in FIELDS if name.startswith("outputs.")}
    assert "usual_loop" in summary
    assert {f"usual_loop.{name}" for name in summary["usual_loop"]} <= FIELDS.keys()
    assert summary["samples"] == summary["digest_checks"] == summary["coder_bits_up"] == 600
    assert summary["desyncs"] == summary["erasures"] == summary["commands_late"] == 0
    assert summary["baud_measured"] == pytest.approx(10.0, abs=1e-6)
    assert summary["window_start_s"] == 25.0
    assert 0.0 < summary["error_coded_max_fraction"] <= 0.05
    assert summary["error_live_max_fraction"] == summary["error_coded_max_fraction"]

    folder = RunFolder(tmp_path / "run")
    assert folder.figure.read_bytes().startswith(b"\x89PNG")
    assert load_config(path=folder.config).transmitter.plant.mismatch == 0.1
    assert compare_runs(folder.path).verdict is Verdict.EQUAL, "the two ends' recordings"
    for path in (folder.transmitter, folder.receiver):
        stream = MessageStream(path)
        rows = sum(
            len(times)
            for block in rows_in_blocks(stream, {"tick": None})
            for times, _ in block.values()
        )
        assert rows == 6_000
        for topic, channel in stream.channels.items():
            for field in channel.fields:
                assert field.description, (topic, field.name)
                ending = field.name.rpartition("_")[2]
                assert ending not in ("s", "ms", "ns") or field.unit == ending, (topic, field.name)


def test_when_a_person_runs_it_then_one_flight_is_shown_beside_the_usual_loop(tmp_path: Path) -> None:
    given = ["--set", "coder.window_signs=3", "--duration", "30s"]
    ended = run("demo", *given, "--set", "coder.decay=0.9", "--mismatch", "10%", cwd=tmp_path)
    assert ended.code == 0, ended.err
    assert ended.out.startswith("✓ Flight finished: 30 s, both codecs equal in 300 of 300 checks")
    assert "digest_checks" not in ended.out, "that is for --verbose"
    assert "pitch off the model by +10%; tuned-10baud over zenoh" in ended.out
    assert "° over 1000 bit/s), " in ended.out
    assert len(list((tmp_path / "runs").iterdir())) == 1
    again = ended.out.partition("Next: ")[2].split()
    assert again[:2] + again[-1:] == ["tenbaud", "demo", "--view"]
    fields = [one for one in again if "=" in one]
    assert fields == ["coder.window_signs=3", "coder.decay=0.9"]
    assert {again[at + 1] for at, one in enumerate(again) if one in ("--duration", "--mismatch")} == {
        "30.0",
        "0.1",
    }


def test_the_usual_loop_beside_a_flight_is_the_one_that_both_sessions_fly() -> None:
    changes: dict[str, Any] = {"duration_s": 3.0, "seed": 4}
    changes["transmitter"] = {"plant": {"mismatch": 0.1, "disturbance": "q=2e-2"}}
    usual = usual_flight(agree(load_config("tuned-10baud", None, changes), "virtual"))
    assert usual is not None
    (flown,) = fly_plain(load_config("usual-1000baud", None, changes)).outputs
    assert usual.figures["tracking_rms_rad"] == flown.tracking_rms
    assert usual.figures["error_live_rms_rad"] == flown.error_live_rms
    assert max(abs(usual.curve[1])) == flown.amplitude


@pytest.mark.parametrize("preset", ["servo-10baud", "usual-1000baud"])
def test_there_is_no_usual_loop_for_other_plants_and_for_itself(preset: str) -> None:
    assert usual_flight(agree(load_config(preset), "virtual")) is None


def test_when_the_usual_loop_is_flown_by_two_processes_then_its_states_are_those_of_one(
    tmp_path: Path,
) -> None:
    for name, how in (("two", []), ("one", ["--link", "memory"])):
        flown = ["--preset", "usual-1000baud", "--mismatch", "10%", "--duration", "1", "--out", name]
        assert run("demo", "--json", *flown, *how, cwd=tmp_path).summary["digest_checks"] == 100
    assert compare_runs(tmp_path / "two", tmp_path / "one").verdict is Verdict.EQUAL


@pytest.mark.skipif(not REAL_FLIGHT.is_file(), reason="the recorded flights are not beside the tree")
def test_when_a_real_flight_is_replayed_then_its_pitch_is_known_remotely(tmp_path: Path) -> None:
    replayed = ("--rig", f"replay:{REAL_FLIGHT}")
    ended = run("demo", "--json", *replayed, "--out", "run", cwd=tmp_path)
    assert ended.code == 0, ended.err
    summary = ended.summary
    assert summary["preset"] == "uiuc-10baud"
    assert summary["samples"] == summary["digest_checks"] == 1200
    assert summary["error_live_rms_fraction"] <= 0.08


def test_when_the_wire_delivers_at_the_end_of_a_slot_then_it_flies_on_the_provisional_copy(
    tmp_path: Path,
) -> None:
    settings = {"channel.delivery": "end", "transmitter.plant.mismatch": 0.1}
    summary = fly("tuned-10baud", settings=settings, out=tmp_path / "run").summary
    assert summary["lead_ticks"] == 13
    assert summary["desyncs"] == summary["erasures"] == summary["commands_late"] == 0
    assert summary["error_live_max_fraction"] > summary["error_coded_max_fraction"]
    assert summary["error_live_max_fraction"] < 0.05


@pytest.mark.real_time
def test_when_flown_on_every_clock_and_link_then_the_states_are_identical_and_ten_baud_are_measured(
    tmp_path: Path,
) -> None:
    # The lead leaves a busy machine time; what it misses all the same makes it another flight.
    flown = ["--lead", "105", "--set", "channel.deadline_allowance_s=1", *PATIENT]
    flown += ["--duration", "3", "--mismatch", "0.1", "--disturbance", "q=2e-3"]

    def summary_of(name: str, *how: str) -> dict[str, Any]:
        ended = run("demo", "--json", "--out", name, *flown, *how, cwd=tmp_path)
        assert ended.code == 0, ended.err
        check_flown(ended.summary, 30)
        return ended.summary

    with Pacer() as pacer:
        real = summary_of("real", "--clock", "real")
    summary_of("virtual")
    summary_of("memory", "--link", "memory")
    assert real["loop_late_ms_p99"] is not None
    need_idle(real)
    for other in ("virtual", "memory"):
        compared = compare_runs(tmp_path / "real", tmp_path / other)
        assert compared.verdict is Verdict.EQUAL, f"real and {other}: {compared}"
    # With an allowance of a second no count tells that the receiver was held up.
    pacer.need_idle()
    # 50 ms of three seconds: the first or the last symbol may be held up.
    assert real["baud_measured"] == pytest.approx(10.0, abs=0.17)


def test_when_the_seed_changes_then_the_disturbed_flight_changes(tmp_path: Path) -> None:
    flown = ["--disturbance", "q=2e-2", "--duration", "3", "--link", "memory", "--json"]
    for name, seed in (("a", "1"), ("b", "2"), ("c", "1")):
        assert run("demo", *flown, "--seed", seed, "--out", name, cwd=tmp_path).code == 0
    assert compare_runs(tmp_path / "a", tmp_path / "c").verdict is Verdict.EQUAL
    assert compare_runs(tmp_path / "a", tmp_path / "b").verdict is Verdict.DIFFERENT
    assert run("diff", "a", "b", cwd=tmp_path).code == 1
    assert run("diff", "a", "c", cwd=tmp_path).code == 0
