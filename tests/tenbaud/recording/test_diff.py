from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tenbaud.recording.diff import first_difference
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.recording.rows import (
    EVENT,
    RECEIVER_SAMPLE,
    SAMPLE,
    TICK,
    Rows,
    sample_row,
    tick_row,
)

Record = Callable[[Path, Rows], Path]
TICKS: Rows = [(TICK, tick * 10, tick_row(tick, tick / 7)) for tick in range(50)]


def changed(row: int, **values: object) -> Rows:
    """TICKS with some fields of one row replaced."""
    rows = list(TICKS)
    channel, time_ns, old = rows[row]
    names = [field.name for field in channel.fields]
    new = tuple(values.get(name, value) for name, value in zip(names, old, strict=True))
    return [*rows[:row], (channel, time_ns, new), *rows[row + 1 :]]


def test_equal_runs_have_no_difference(tmp_path: Path, fly: Callable[..., Path]) -> None:
    first, second = fly(tmp_path / "a"), fly(tmp_path / "b")
    assert first_difference(first, second) is None
    assert first_difference(first) is None
    assert first_difference(first / "transmitter.mcap", first / "receiver.mcap") is None


@pytest.mark.parametrize(
    ("values", "field", "seen"),
    [
        ({"measured_rad": [0.1 + 0.2]}, "measured_rad[0]", 0.1 + 0.2),
        ({"measured_rad": [1.0, 2.0]}, "measured_rad", [1.0, 2.0]),
        ({"measured_rad": [float("nan")]}, "measured_rad[0]", None),
        ({"true_rad": [0.0]}, "true_rad", [0.0]),
        ({"guard": "latched"}, "guard", "latched"),
        ({"late": True}, "late", True),
    ],
)
def test_changed_value_is_found(
    tmp_path: Path, record: Record, values: dict[str, object], field: str, seen: object
) -> None:
    first = record(tmp_path / "a.mcap", TICKS)
    second = record(tmp_path / "b.mcap", changed(17, **values))
    difference = first_difference(first, second)
    assert difference is not None
    assert (difference.kind, difference.topic, difference.key) == ("value", "tick", 17)
    assert (difference.field, difference.second_value) == (field, seen)
    assert difference.time_ns == 170
    assert str(first) in str(difference)
    assert str(second) in str(difference)
    assert "tick 17" in str(difference)


def test_sign_of_zero_is_a_difference_and_two_nans_are_none(tmp_path: Path, record: Record) -> None:
    plus = record(tmp_path / "a.mcap", changed(5, measured_rad=[0.0]))
    minus = record(tmp_path / "b.mcap", changed(5, measured_rad=[-0.0]))
    assert first_difference(plus, minus) is not None
    nans = [record(tmp_path / name, changed(5, measured_rad=[float("nan")])) for name in ("c", "d")]
    assert first_difference(*nans) is None


def test_wall_clock_and_events_are_ignored(tmp_path: Path, record: Record) -> None:
    event = (EVENT, 3, (0.1, "start", None, "by hand"))
    first = record(tmp_path / "a.mcap", TICKS)
    second = record(tmp_path / "b.mcap", [event, *changed(4, lateness_ms=99.0)])
    assert first_difference(first, second) is None


def test_row_missing_between_others_is_a_difference(tmp_path: Path, record: Record) -> None:
    whole = record(tmp_path / "a.mcap", TICKS)
    holed = record(tmp_path / "b.mcap", [*TICKS[:20], *TICKS[21:]])
    for pair in ((whole, holed), (holed, whole)):
        difference = first_difference(*pair)
        assert difference is not None
        assert (difference.kind, difference.key) == ("missing row", 20)
        assert f"missing in {holed}" in str(difference)


def test_shorter_side_is_reported_only_if_nothing_else_differs(tmp_path: Path, record: Record) -> None:
    samples = [(SAMPLE, k * 100, sample_row(k, word=[1], state=k / 3)) for k in range(5)]
    wrong = [*samples[:4], (SAMPLE, 400, sample_row(4, word=[1], state=9.0))]
    whole = record(tmp_path / "a.mcap", [*TICKS, *samples])
    short = record(tmp_path / "b.mcap", [*TICKS[:30], *samples])
    both = record(tmp_path / "c.mcap", [*TICKS[:30], *wrong])
    for pair in ((whole, short), (short, whole)):
        difference = first_difference(*pair)
        assert difference is not None
        assert (difference.kind, difference.topic, difference.key) == ("length", "tick", 30)
        assert f"{short} ends before" in str(difference)
    difference = first_difference(whole, both)
    assert difference is not None
    assert (difference.kind, difference.topic, difference.key) == ("value", "sample", 4)
    assert difference.field == "state[0]"


def test_earliest_of_several_differences_wins(tmp_path: Path, record: Record) -> None:
    sample = (SAMPLE, 95, sample_row(0, word=[1], state=0.0))
    other = (SAMPLE, 95, sample_row(0, word=None, state=0.0))
    first = record(tmp_path / "a.mcap", [*TICKS, sample])
    second = record(tmp_path / "b.mcap", [*changed(17, guard="latched"), other])
    difference = first_difference(first, second)
    assert difference is not None
    assert (difference.topic, difference.field) == ("sample", "word")


def test_two_ends_of_one_run_are_compared_by_sample(tmp_path: Path, record: Record) -> None:
    sent = [(SAMPLE, k * 100, sample_row(k, word=[1], state=k / 3)) for k in range(9)]
    heard = [
        (RECEIVER_SAMPLE, k * 100, (*sample_row(k, word=[1], state=k / 3), k + 0.1)) for k in range(10)
    ]
    record(tmp_path / "run/transmitter.mcap", [*TICKS, *sent])
    record(tmp_path / "run/receiver.mcap", heard)
    difference = first_difference(tmp_path / "run")
    assert difference is not None
    assert (difference.kind, difference.key_name, difference.key) == ("length", "sample", 9)

    # Each machine kept its own end, and one sample went wrong.
    heard[6] = (RECEIVER_SAMPLE, 600, (*sample_row(6, word=[-1], state=2.0), 6.1))
    here = record(tmp_path / "here/transmitter.mcap", sent).parent
    there = record(tmp_path / "there/receiver.mcap", heard).parent
    difference = first_difference(here, there)
    assert difference is not None
    assert (difference.key, difference.field, difference.first_value) == (6, "word[0]", 1)


def test_what_cannot_be_compared_is_said(tmp_path: Path, record: Record) -> None:
    path = record(tmp_path / "run/transmitter.mcap", TICKS)
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordingError, match="one is a folder"):
        first_difference(path, path.parent)
    with pytest.raises(RecordingError, match="empty holds no recording"):
        first_difference(path.parent, tmp_path / "empty")
    with pytest.raises(RecordingError, match=r"receiver\.mcap cannot be read"):
        first_difference(path.parent)
    record(tmp_path / "run/receiver.mcap", TICKS)
    with pytest.raises(RecordingError, match="no topic 'sample'"):
        first_difference(path.parent)
