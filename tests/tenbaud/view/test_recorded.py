"""Recordings as board messages: at any moment, of whole files and of incomplete ones."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from channel.protocol.recording import Field, RecordChannel
from tenbaud import Run
from tenbaud.cli.app import run as command
from tenbaud.recording.writer import McapRecorder
from tenbaud.view.recorded import POINTS, RecordedFlight, RunsDiffer, recorded_flights
from tenbaud.view.replay import described, moments
from tests.tenbaud.flown import SECONDS, flown
from tests.tenbaud.processes import REPOSITORY
from tests.tenbaud.recording.rows import SAMPLE, TICK, sample_row, tick_row

OLD = REPOSITORY / "tests/golden/recordings/two-epochs-0.1.0"
AT_S = 7.05


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("runs") / "lossy"
    sabotage = {"transmitter__sabotage": "sample=60,field=range"}
    return flown(folder, link__impairments="up:loss=0.3", channel__delivery="end", **sabotage)


@pytest.fixture(scope="module")
def flight(lossy: Run) -> RecordedFlight:
    return RecordedFlight(lossy)


def test_a_moment_of_a_narrow_flight_says_what_was_certain(tmp_path: Path) -> None:
    run = flown(tmp_path / "narrow", channel__downlink="narrow")
    flight = RecordedFlight(run)
    assert flight.missing == ""
    head = flight.moment(AT_S)["heads"]["transmitter"]
    (row,) = [one for one in run.table("transmitter", "hypotheses").rows if one["sample"] == 69]
    narrow = head["narrow"]
    assert [narrow[name] for name in ("confirmed_to", "size", "rest")] == [
        row[name] for name in ("confirmed_to", "size", "rest")
    ]
    assert narrow["sample"] - narrow["confirmed_to"] < 40
    assert (narrow["baud_measured"], narrow["baud_configured"]) == (20.0, 20.0)
    assert narrow["is_mirrored"]
    number, _, _, digest, peer, _ = flight.moment(AT_S)["samples"][row["confirmed_to"] - 1]
    assert number == row["confirmed_to"] - 1
    assert digest == peer != ""


def test_a_moment_is_what_the_run_recorded_up_to_then(lossy: Run, flight: RecordedFlight) -> None:
    moment = flight.moment(AT_S)
    tick, samples = round(AT_S * 100), int(AT_S * 10)
    assert moment["point"] == [
        pytest.approx(AT_S),
        [lossy.pitch[tick]],
        [lossy.estimate[tick]],
        [lossy.range[tick]],
    ]
    assert moment["decision"][1] == [lossy.reference[tick]]
    rows = [row for row in lossy.table("transmitter", "sample").rows if row["sample"] < samples]
    number, sent, taken, digest, peer, _ = moment["samples"][-1]
    assert (number, sent, taken) == (
        rows[-1]["sample"], list(rows[-1]["word_sent"]), rows[-1]["word"] and list(rows[-1]["word"]),
    )  # fmt: skip
    assert digest == peer == rows[-1]["digest"]
    up, down = moment["heads"]["transmitter"], moment["heads"]["receiver"]
    assert up["counts"]["erasures"] == sum(row["word"] is None for row in rows) > 0
    assert up["counts"]["desyncs"] == up["counts"]["rejoins"] == 1
    assert up["counts"]["digest_checks"] == len(rows)
    assert (up["phase"], up["guard"], up["epoch"]) == ("flying", "running", 1)
    came = sum(row["word"] is not None for row in rows if row["sample"] >= samples - 50)
    assert down["baud_measured"] == pytest.approx(came / 5.0, abs=0.3)
    assert flight.moment(SECONDS)["heads"]["transmitter"]["phase"] == "ended"
    assert {one["kind"] for one in moment["events"]} >= {"started", "desync", "rejoin"}
    assert max(one["time_s"] for one in moment["events"]) <= AT_S


def test_a_long_window_keeps_the_extremes_and_a_short_one_every_tick(
    lossy: Run, flight: RecordedFlight
) -> None:
    assert len(lossy.time_s) > POINTS
    points = flight.moment(0.0, (0.0, SECONDS))["points"]
    assert len(points) < len(lossy.time_s)
    values, estimates = (np.array([row[place][0] for row in points], dtype=float) for place in (1, 2))
    for shown, whole in ((values, lossy.pitch), (values - estimates, lossy.pitch - lossy.estimate)):
        assert (np.nanmin(shown), np.nanmax(shown)) == (np.nanmin(whole), np.nanmax(whole))
    window = flight.moment(0.0, (3.0, 5.0))["points"]
    assert [row[0] for row in window] == pytest.approx(np.arange(300, 501) * 0.01)
    decisions = flight.moment(0.0, (0.0, SECONDS))["decisions"]
    assert len(decisions) < 10


def test_a_set_point_that_always_changes_keeps_its_extremes_too(
    lossy: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = RecordedFlight(lossy)
    wave = np.sin(np.arange(len(lossy.time_s)) / 100.0)
    wave[[701, 905]] = 3.0, -3.0
    monkeypatch.setattr(flight, "_references", wave[:, np.newaxis])
    decisions = flight.moment(0.0, (0.0, SECONDS))["decisions"]
    assert len(decisions) < len(wave)
    shown = [row[1][0] for row in decisions]
    assert (min(shown), max(shown)) == (-3.0, 3.0)


def test_a_question_without_a_window_gets_no_curves_and_nonsense_is_refused(
    flight: RecordedFlight,
) -> None:
    (one,) = orjson.loads(moments([flight], '{"at_s": 1.0}'))["runs"]
    assert "points" not in one
    (one,) = orjson.loads(moments([flight], '{"at_s": 1e9, "from_s": -5, "to_s": 1e9}'))["runs"]
    assert one["at_s"] == SECONDS
    endless = ('{"at_s":1,"from_s":"-inf","to_s":"inf"}', '{"at_s":"inf"}', '{"at_s":"nan"}')
    junk = ("", "[]", "{}", '{"at_s": "x"}', '{"at_s": 1, "from_s": 1}', '{"at_s": NaN}', "3")
    for question in (*junk, *endless):
        with pytest.raises((ValueError, TypeError)):
            moments([flight], question)


def test_an_old_recording_is_shown_with_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tenbaud.config.version.software_version", lambda: "9.9.9")
    flight = RecordedFlight(Run(OLD))
    moment = flight.moment(4.0, (0.0, 8.0))
    # Between two epochs: nothing is estimated there.
    assert np.isnan(moment["point"][2]).tolist() == [True]
    assert moment["heads"]["transmitter"]["phase"] == "rejoining"
    assert any("was recorded by tenbaud 0.1.0; this is 9.9.9" in note for note in flight.notes)
    assert moment["heads"]["transmitter"]["guard"] == "ramping"


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_of_one_end_alone_it_shows_what_is_there_and_says_what_is_missing(
    end: str, lossy: Run, tmp_path: Path
) -> None:
    (tmp_path / "run").mkdir()
    shutil.copy(lossy.path / f"{end}.mcap", tmp_path / "run")
    flight = RecordedFlight(Run(tmp_path / "run"))
    moment = flight.moment(AT_S, (0.0, SECONDS))
    assert list(moment["heads"]) == [end]
    (note,) = flight.notes
    value, estimate, reference = moment["point"][1], moment["point"][2], moment["decision"][1]
    if end == "transmitter":
        assert note == "run (tuned-10baud) is without the receiver's recording: no set-points, no rate"
        assert flight.missing == ""
        assert (np.isnan(reference[0]), np.isnan(value[0])) == (True, False)
    else:
        assert "without the transmitter's recording: no outputs, no errors" in note
        assert "transmitter's recording" in flight.missing
        assert (np.isnan(value[0]), np.isnan(estimate[0]), reference) == (True, False, [np.pi / 2])
    assert moment["samples"][-1][4]
    orjson.dumps(moment)


def test_a_cut_recording_is_shown_up_to_the_cut(lossy: Run, tmp_path: Path) -> None:
    shutil.copytree(lossy.path, tmp_path / "run")
    file = tmp_path / "run" / "transmitter.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    (tmp_path / "run" / "receiver.mcap").unlink()
    flight = RecordedFlight(Run(tmp_path / "run"))
    assert 1.0 < flight.duration_s < SECONDS
    assert any("was cut" in note for note in flight.notes)
    moment = flight.moment(SECONDS, (0.0, SECONDS))
    assert moment["heads"]["transmitter"]["phase"] == "flying"
    assert moment["at_s"] == flight.duration_s


def test_ticks_without_estimates_are_shown_as_such(tmp_path: Path) -> None:
    path = tmp_path / "run" / "transmitter.mcap"
    path.parent.mkdir()
    with McapRecorder(path, {"role": "transmitter"}) as recorder:
        for tick in range(300):
            recorder.write(TICK, tick * 10_000_000, tick_row(tick, 0.001 * tick))
    flight = RecordedFlight(Run(path.parent))
    moment = flight.moment(1.0, (0.0, 3.0))
    assert moment["point"][1] == [pytest.approx(0.1)]
    assert orjson.loads(orjson.dumps(moment))["point"][2:] == [[None], [None]]
    assert flight.missing == "no digests were recorded"
    assert "run is without estimates" in flight.notes


def test_digests_of_a_recording_that_begins_late_are_compared(tmp_path: Path) -> None:
    path = tmp_path / "run" / "transmitter.mcap"
    path.parent.mkdir()
    sample = RecordChannel("sample", (*SAMPLE.fields, Field("peer_digest", "string")))
    with McapRecorder(path, {"role": "transmitter"}) as recorder:
        for tick in range(5000, 5100):
            recorder.write(TICK, tick * 10_000_000, tick_row(tick, 0.0))
        row = sample_row(500, word=[1], state=0.0)
        recorder.write(sample, 5000 * 10_000_000, (*row, row[-1]))
    assert RecordedFlight(Run(path.parent)).missing == ""


def test_runs_of_unlike_outputs_and_too_many_runs_are_refused(lossy: Run, tmp_path: Path) -> None:
    other = flown(tmp_path / "furuta", "furuta-50baud", duration_s=1.0)
    with pytest.raises(RunsDiffer, match=r"lossy has pitch, rad, .*furuta has arm, rad; pendulum, rad"):
        recorded_flights([lossy, other])
    with pytest.raises(RunsDiffer, match="at most 4"):
        recorded_flights([lossy] * 5)


def test_two_flights_have_a_common_cursor(lossy: Run, tmp_path: Path) -> None:
    short = flown(tmp_path / "short", "usual-1000baud", duration_s=3.0)
    flights = recorded_flights([lossy, short])
    told: dict[str, Any] = described(flights)
    assert [one["name"] for one in told["flights"]] == [
        "lossy (tuned-10baud)",
        "short (usual-1000baud)",
    ]
    assert (told["duration_s"], told["step_s"]) == (SECONDS, pytest.approx(0.01))
    first, second = orjson.loads(moments(flights, f'{{"at_s": {AT_S}}}'))["runs"]
    assert (first["at_s"], second["at_s"]) == (AT_S, 3.0)
    assert second["heads"]["transmitter"]["phase"] == "ended"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "nowhere does not exist. Give the folder of a run"),
        (["."], "holds neither transmitter.mcap nor receiver.mcap. Give the folder of one run"),
        ([str(OLD), "--session", "lab"], "and --session are for live flights"),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_words(
    arguments: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(["view", "--port", "0", *arguments]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
