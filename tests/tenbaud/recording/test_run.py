from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from tenbaud import Run
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.signals import definitions
from tests.tenbaud.flown import SECONDS, flown
from tests.tenbaud.processes import REPOSITORY

TICKS = round(SECONDS * 100)


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("runs") / "lossy"
    return flown(folder, link__impairments="loss=0.3", channel__delivery="end")


def test_every_signal_is_on_the_common_time_base_with_a_unit_and_a_meaning(lossy: Run) -> None:
    assert len(lossy.time_s) == TICKS
    assert lossy.time_s[0] == 0.0
    assert np.diff(lossy.time_s) == pytest.approx(0.01)
    for signal in lossy.signals.values():
        assert signal.values.shape == (TICKS,), signal.name
        assert signal.description
    assert lossy.units["pitch"] == "rad"
    assert lossy.units["front"] == "V"
    assert {"reference", "pitch", "estimate", "estimate_live", "range", "symbol", "erased"} <= set(
        lossy.names
    )


def test_every_signal_is_in_the_table_of_the_documentation() -> None:
    text = (REPOSITORY / "docs" / "recordings.md").read_text()
    for name in definitions(PITCH_SIGNALS):
        assert f"`{name}`" in text, name


def test_the_gap_gauge_holds_its_last_value(lossy: Run) -> None:
    rows = [row for row in lossy.table("transmitter", "gap").rows if row["rms_over_floor"] is not None]
    assert len(rows) > 3
    per_sample = lossy.base.ticks_per_sample
    for before, after in itertools.pairwise(rows):
        span = lossy.gap_to_floor[before["sample"] * per_sample : after["sample"] * per_sample]
        assert (span == before["rms_over_floor"]).all()
    assert np.isnan(lossy.gap_to_floor[0])


def test_signals_are_what_the_rows_say(lossy: Run) -> None:
    ticks = lossy.table("transmitter", "tick")
    for row in ticks.rows[::97]:
        assert lossy.pitch[row["tick"]] == row["true"][0]
        assert lossy.front[row["tick"]] == row["applied"][0]
    for row in lossy.table("transmitter", "estimate").rows[::97]:
        assert lossy.estimate[row["tick"]] == row["coded_state"][0]
    for row in lossy.table("receiver", "tick").rows[::97]:
        if row["tick"] < TICKS:
            assert lossy.reference[row["tick"]] == row["reference"][0]
    np.testing.assert_array_equal(lossy.error_coded, lossy.pitch - lossy.estimate)


def test_what_is_per_sample_is_held_over_its_ticks_and_an_erasure_is_no_symbol(lossy: Run) -> None:
    erased = 0
    for row in lossy.table("transmitter", "sample").rows:
        span = slice(10 * row["sample"], 10 * row["sample"] + 10)
        assert (lossy.range[span] == row["range"][0]).all()
        if row["word"] is None:
            erased += 1
            assert np.isnan(lossy.symbol[span]).all()
            assert (lossy.erased[span] == 1.0).all()
        else:
            assert (lossy.symbol[span] == row["word"][0]).all()
    assert erased > 10


def test_symbols_of_a_word_stand_in_their_slots(tmp_path: Path) -> None:
    run = flown(tmp_path / "words", "usual-1000baud", duration_s=1.0)
    row = run.table("transmitter", "sample").rows[0]
    ticks, per_word = run.base.ticks_per_sample, len(row["word"])
    expected = [row["word"][tick * per_word // ticks] for tick in range(ticks)]
    assert run.symbol[:ticks].tolist() == expected


def test_summary_events_and_configuration_are_there(lossy: Run) -> None:
    assert lossy.summary["coder_bits_up"] == len(lossy.table("transmitter", "symbol"))
    assert lossy.config.link.impairments == "loss=0.3"
    assert [event["kind"] for event in lossy.events][:2] == ["started", "started"]
    assert {event["end"] for event in lossy.events} == {"transmitter", "receiver"}
    assert lossy.complete
    assert "1200 ticks of 0.01 s" in repr(lossy)
    assert "pitch" in dir(lossy)


def test_plot_is_a_figure_and_a_file(lossy: Run, tmp_path: Path) -> None:
    figure = lossy.plot(tmp_path / "flight.png")
    assert len(figure.axes) == 5
    assert (tmp_path / "flight.png").read_bytes().startswith(b"\x89PNG")


def test_one_end_alone_gives_what_it_recorded(lossy: Run) -> None:
    receiver = Run(lossy.folder.receiver)
    assert receiver.ends == ["receiver"]
    assert {"reference", "estimate_live", "symbol"} <= set(receiver.names)
    with pytest.raises(AttributeError, match="the transmitter's recording is not here"):
        _ = receiver.pitch
    with pytest.raises(RecordingError, match="transmitter's recording"):
        receiver.plot()


def test_a_cut_recording_is_read_up_to_the_cut(lossy: Run, tmp_path: Path) -> None:
    # One small chunk per flush: the first of them is whole, the rest is cut away.
    data = lossy.folder.transmitter.read_bytes()
    cut = tmp_path / "transmitter.mcap"
    cut.write_bytes(data[:-20])
    run = Run(cut)
    assert not run.complete
    np.testing.assert_array_equal(run.pitch, lossy.pitch)
    assert "cut" in repr(run)


def test_a_wrong_name_is_answered_with_the_right_ones(lossy: Run, tmp_path: Path) -> None:
    with pytest.raises(AttributeError, match="its signals are reference, pitch"):
        _ = lossy.pich
    with pytest.raises(RecordingError, match="has no topic 'ticks'"):
        lossy.table("transmitter", "ticks")
    with pytest.raises(KeyError, match="has no column 'volts'"):
        lossy.table("transmitter", "tick")["volts"]
    with pytest.raises(RecordingError, match="does not exist"):
        Run(tmp_path / "none")


def test_importing_tenbaud_loads_no_library() -> None:
    code = "import sys, tenbaud; print([m for m in ('numpy', 'mcap', 'pydantic') if m in sys.modules])"
    told = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=True
    )
    assert told.stdout.strip() == "[]"
