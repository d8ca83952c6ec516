from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tenbaud.recording.inspect import describe_json, describe_text
from tests.tenbaud.flown import flown
from tests.tenbaud.recording.rows import EVENT, Rows


def test_run_folder_is_described_file_by_file(tmp_path: Path, fly: Callable[..., Path]) -> None:
    folder = fly(tmp_path / "run", ticks=100)
    transmitter, receiver = describe_json(folder)
    names = [Path(one["path"]).name for one in (transmitter, receiver)]
    assert names == ["transmitter.mcap", "receiver.mcap"]
    assert transmitter["complete"]
    assert transmitter["rows_dropped"] == 0
    text = describe_text(folder)
    for words in (
        "complete",
        "tick: 100 rows, 0.000 s to 0.990 s",
        "measured     [rad]  what the encoder read",
        "lateness_ms  [ms]  after the due time  (wall clock)",
        "seed = 7",
        "start: the first symbol",
    ):
        assert words in text


def test_a_real_run_is_headed_by_its_figures_and_its_configuration_is_readable(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", duration_s=3.0)
    text = describe_text(run.path)
    assert text.startswith("tuned-10baud: the flight is over, 3 s, 30 bits up")
    assert "    timing: lead_ticks 0, symbol_period_s 0.1, tick_s 0.01" in text
    assert "  inputs: front, V; rear, V\n  outputs: pitch, rad\n" in text
    assert "recover" not in text
    described = json.loads(json.dumps(describe_json(run.path)))
    assert [one["complete"] for one in described] == [True, True]
    fields = described[0]["topics"]["tick"]["fields"]
    assert {"measured", "applied"} <= {field["name"] for field in fields}
    assert described[0]["topics"]["tick"]["rows"] == 300


def test_a_narrow_run_is_described_by_its_down_symbols_and_what_is_certain(tmp_path: Path) -> None:
    run = flown(tmp_path / "narrow", duration_s=6.0, channel__downlink="narrow")
    text = describe_text(run.path)
    summary, certain = text.splitlines()[:2]
    confirmed = run.summary["narrow"]["samples_confirmed"]
    assert summary.endswith(f"60 bits up, 120 bits down, {confirmed} of 60 samples confirmed")
    assert certain.startswith("  certain after ")
    assert "echo" not in text
    assert "  as above: preset, clock" in text, "the other end repeats nothing"
    assert text.count("what kind of event") == text.count("its down symbols in the order of") == 1
    assert len(text.splitlines()) < 170


def test_cut_file_is_called_cut(tmp_path: Path, fly: Callable[..., Path]) -> None:
    path = fly(tmp_path / "run", ticks=100) / "transmitter.mcap"
    path.write_bytes(path.read_bytes()[:-100])
    [description] = describe_json(path)
    assert not description["complete"]
    assert "cut: these are the rows up to the cut" in describe_text(path)
    assert f"`tenbaud recover {path}`" in describe_text(path)


def test_only_the_first_twenty_events_are_listed(
    tmp_path: Path, record: Callable[[Path, Rows], Path]
) -> None:
    rows = [(EVENT, k, (k / 10, "erased", k, f"symbol {k} came late")) for k in range(30)]
    path = record(tmp_path / "a.mcap", rows)
    text = describe_text(path)
    assert "the first 20 of 30 events" in text
    assert "1.900 s  erased: symbol 19 came late (sample 19)" in text
    assert "symbol 20" not in text
