from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from channel.protocol.lockstep import LOCKSTEP_CHANNEL
from channel.protocol.recording import EPOCH_CHANNEL, RecordChannel
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.processes import run as run_command
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
    assert compare_runs(first, second).verdict is Verdict.EQUAL
    assert compare_runs(first).verdict is Verdict.EQUAL
    assert compare_runs(first / "transmitter.mcap", first / "receiver.mcap").verdict is Verdict.EQUAL


@pytest.mark.parametrize(
    ("values", "field", "seen"),
    [
        ({"measured": [0.1 + 0.2]}, "measured[0]", 0.1 + 0.2),
        ({"measured": [1.0, 2.0]}, "measured", [1.0, 2.0]),
        ({"measured": [float("nan")]}, "measured[0]", None),
        ({"true": [0.0]}, "true", [0.0]),
        ({"guard": "latched"}, "guard", "latched"),
        ({"late": True}, "late", True),
    ],
)
def test_changed_value_is_found(
    tmp_path: Path, record: Record, values: dict[str, object], field: str, seen: object
) -> None:
    first = record(tmp_path / "a.mcap", TICKS)
    second = record(tmp_path / "b.mcap", changed(17, **values))
    difference = compare_runs(first, second).difference
    assert difference is not None
    assert (difference.topic, difference.key) == ("tick", 17)
    assert (difference.field, difference.second_value) == (field, seen)
    assert difference.time_ns == 170
    assert str(first) in str(difference)
    assert str(second) in str(difference)
    assert "tick 17" in str(difference)


def test_sign_of_zero_is_a_difference_and_two_nans_are_none(tmp_path: Path, record: Record) -> None:
    plus = record(tmp_path / "a.mcap", changed(5, measured=[0.0]))
    minus = record(tmp_path / "b.mcap", changed(5, measured=[-0.0]))
    assert compare_runs(plus, minus).verdict is Verdict.DIFFERENT
    nans = [record(tmp_path / name, changed(5, measured=[float("nan")])) for name in ("c", "d")]
    assert compare_runs(*nans).verdict is Verdict.EQUAL


def test_wall_clock_and_events_are_ignored(tmp_path: Path, record: Record) -> None:
    event = (EVENT, 3, (0.1, "start", None, "by hand"))
    first = record(tmp_path / "a.mcap", TICKS)
    second = record(tmp_path / "b.mcap", [event, *changed(4, lateness_ms=99.0)])
    assert compare_runs(first, second).verdict is Verdict.EQUAL


def test_missing_rows_are_named_and_the_files_not_comparable(tmp_path: Path, record: Record) -> None:
    whole = record(tmp_path / "a.mcap", TICKS)
    holed = record(tmp_path / "b.mcap", [*TICKS[:20], *TICKS[23:]])
    for pair in ((whole, holed), (holed, whole)):
        compared = compare_runs(*pair)
        assert compared.verdict is Verdict.NOT_COMPARABLE
        (missing,) = compared.missing
        assert (missing.path, missing.first, missing.last, missing.rows) == (holed, 20, 22, 3)
        assert not missing.ends
        assert f"tick 20 to 22: 3 rows missing in {holed}" in str(compared)
        assert compared.rows == 47


def test_a_difference_beside_missing_rows_is_a_difference(tmp_path: Path, record: Record) -> None:
    samples = [(SAMPLE, k * 100, sample_row(k, word=[1], state=k / 3)) for k in range(5)]
    wrong = [*samples[:4], (SAMPLE, 400, sample_row(4, word=[1], state=9.0))]
    whole = record(tmp_path / "a.mcap", [*TICKS, *samples])
    short = record(tmp_path / "b.mcap", [*TICKS[:30], *samples])
    both = record(tmp_path / "c.mcap", [*TICKS[:30], *wrong])
    for pair in ((whole, short), (short, whole)):
        compared = compare_runs(*pair)
        assert compared.verdict is Verdict.NOT_COMPARABLE
        assert (compared.missing[0].first, compared.missing[0].ends) == (30, True)
        assert f"20 rows missing at the end of {short}" in str(compared)
    compared = compare_runs(whole, both)
    assert compared.verdict is Verdict.DIFFERENT
    difference = compared.difference
    assert difference is not None
    assert (difference.topic, difference.key, difference.field) == ("sample", 4, "state[0]")
    assert "missing at the end" in str(compared)


def test_earliest_of_several_differences_wins(tmp_path: Path, record: Record) -> None:
    sample = (SAMPLE, 95, sample_row(0, word=[1], state=0.0))
    other = (SAMPLE, 95, sample_row(0, word=None, state=0.0))
    first = record(tmp_path / "a.mcap", [*TICKS, sample])
    second = record(tmp_path / "b.mcap", [*changed(17, guard="latched"), other])
    difference = compare_runs(first, second).difference
    assert difference is not None
    assert (difference.topic, difference.field) == ("sample", "word")


def epoch_rows(*starts: tuple[int, int]) -> Rows:
    """Return the rows of epochs: (number, first sample)."""
    return [
        (EPOCH_CHANNEL, first * 100, (first, number, [0.0], [0.0], [0.0])) for number, first in starts
    ]


def samples(*indices: int, receiver: bool = False, wrong: int | None = None) -> Rows:
    """Return the samples of an end, one of them with another state."""
    rows: list[tuple[RecordChannel, int, Sequence[object]]] = []
    for k in indices:
        row = sample_row(k, word=[1], state=9.0 if k == wrong else k / 3)
        rows.append((RECEIVER_SAMPLE, k * 100, (*row, k + 0.1)) if receiver else (SAMPLE, k * 100, row))
    return rows


TWO = epoch_rows((0, 0), (1, 20))


@pytest.mark.parametrize(
    ("upper", "lower", "verdict", "words"),
    [
        # The last echoes of an epoch, and of the flight, may be lost.
        ([*range(8), *range(20, 28)], range(30), Verdict.EQUAL, "never confirmed: 14"),
        (range(10), range(10), Verdict.EQUAL, ""),
        # Between others nothing is missing that the other end has.
        ([*range(4), *range(5, 10)], range(10), Verdict.NOT_COMPARABLE, "sample 4 missing in"),
        (range(10), [*range(4), *range(6, 10)], Verdict.NOT_COMPARABLE, "4 to 5: 2 rows missing in"),
        ([*range(8), *range(22, 28)], range(30), Verdict.NOT_COMPARABLE, "20 to 21: 2 rows missing"),
        (range(25), [*range(18), *range(20, 25)], Verdict.NOT_COMPARABLE, "18 to 19: 2 rows missing"),
        (range(30), range(28), Verdict.NOT_COMPARABLE, "28 to 29: 2 rows missing"),
        ([*range(5), 4, *range(5, 8)], range(8), Verdict.NOT_COMPARABLE, "sample 4 is doubled"),
        ([0, 1, 3, 2, 4], range(5), Verdict.NOT_COMPARABLE, "sample 2 is doubled or out of order"),
        (range(5), range(20, 25), Verdict.NOT_COMPARABLE, "missing"),
    ],
)
def test_the_ends_of_one_run_are_compared_by_epoch_and_sample(
    tmp_path: Path, record: Record, upper: Sequence[int], lower: Sequence[int], verdict: str, words: str
) -> None:
    record(tmp_path / "run/transmitter.mcap", [*TWO, *samples(*upper)])
    record(tmp_path / "run/receiver.mcap", [*TWO, *samples(*lower, receiver=True)])
    compared = compare_runs(tmp_path / "run")
    assert compared.verdict is verdict, str(compared)
    assert words in str(compared)


def test_each_machine_may_have_kept_its_own_end(tmp_path: Path, record: Record) -> None:
    here = record(tmp_path / "here/transmitter.mcap", [*TWO, *samples(*range(9))]).parent
    heard = samples(*range(10), receiver=True, wrong=6)
    there = record(tmp_path / "there/receiver.mcap", [*TWO, *heard]).parent
    for pair in ((here, there), (there, here)):
        compared = compare_runs(*pair)
        assert compared.verdict is Verdict.DIFFERENT
        difference = compared.difference
        assert difference is not None
        assert (difference.key, difference.field, difference.first_value) == (6, "state[0]", 2.0)


def test_a_failure_whose_sample_was_removed_is_not_equal(tmp_path: Path, record: Record) -> None:
    """At the end of an epoch a sample may be missing, but not the one after which the ends differed."""
    values: tuple[object, ...] = (8, 0, "aa", "bb", None, None, None, None, [], [])
    failure = (LOCKSTEP_CHANNEL, 800, values)
    record(tmp_path / "run/transmitter.mcap", [*TWO, *samples(*range(8)), failure])
    record(tmp_path / "run/receiver.mcap", [*TWO, *samples(*range(10), receiver=True)])
    compared = compare_runs(tmp_path / "run")
    assert compared.verdict is Verdict.NOT_COMPARABLE
    assert "sample 8 is missing, of which an end recorded that the two differed" in str(compared)


def test_a_file_that_lacks_rows_by_its_own_count_is_not_equal(tmp_path: Path, record: Record) -> None:
    first, second = (record(tmp_path / name, TICKS) for name in ("a.mcap", "b.mcap"))
    data = second.read_bytes()
    second.write_bytes(data[: len(data) - 200])
    compared = compare_runs(first, second)
    assert compared.verdict is Verdict.NOT_COMPARABLE
    assert f"{second} was cut or damaged" in str(compared)


def test_the_command_ends_with_the_verdict(tmp_path: Path, record: Record) -> None:
    record(tmp_path / "a.mcap", TICKS)
    record(tmp_path / "b.mcap", changed(17, guard="latched"))
    record(tmp_path / "c.mcap", TICKS[:40])
    for other, code, words in (
        ("a.mcap", 0, "no difference between"),
        ("b.mcap", 1, "First difference at tick 17"),
        ("c.mcap", 2, "Not comparable: no value differs in 40 rows that both hold, but"),
    ):
        done = run_command("diff", "a.mcap", other, cwd=tmp_path)
        assert (done.code, done.err) == (code, "")
        assert words in done.out


def test_what_cannot_be_compared_is_said(tmp_path: Path, record: Record) -> None:
    path = record(tmp_path / "run/transmitter.mcap", TICKS)
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordingError, match="one is a folder"):
        compare_runs(path, path.parent)
    with pytest.raises(RecordingError, match="empty holds no recording"):
        compare_runs(path.parent, tmp_path / "empty")
    with pytest.raises(RecordingError, match=r"run holds transmitter\.mcap alone"):
        compare_runs(path.parent)
    record(tmp_path / "run/receiver.mcap", TICKS)
    with pytest.raises(RecordingError, match="no topic 'sample'"):
        compare_runs(path.parent)
