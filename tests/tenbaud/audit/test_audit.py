from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tenbaud import Run
from tenbaud.audit.audit import Audit, audit
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.audit.doctor import Edit, Row, at, doctored
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command

MS = 1_000_000


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "clean", duration_s=8.0)


@pytest.fixture(scope="module")
def rough(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Losses, flips, delays, and a cut that takes a rejoin."""
    faults = "loss=0.2,up:flip=0.05,delay=20ms±10ms,duplicate=0.1,cut=4s+3s"
    return flown(tmp_path_factory.mktemp("runs") / "rough", link__impairments=faults)


def leaks_of(run: Run, folder: Path, end: str, topic: str, edit: Edit) -> Audit:
    result = audit(doctored(run.path, folder / "doctored", end, topic, edit))
    assert not result.passed
    return result


def told(result: Audit) -> str:
    return "\n".join(result.leaks)


def test_a_clean_flight_passes_and_is_counted(clean: Run) -> None:
    result = audit(clean.path)
    assert result.passed, result.leaks + result.gaps
    counted = result.counted
    assert (counted.symbols_sent, counted.symbols_refused, counted.slots) == (80, 0, 80)
    assert counted.symbols_sent == clean.summary["coder_bits_up"]
    assert counted.symbol_bytes == 80 * 15
    assert counted.baud == pytest.approx(10.0)
    assert (counted.samples, counted.erased) == (80, 0)
    assert result.digests_compared == result.jittered_states == 160


def test_a_rough_flight_with_a_rejoin_passes_too(rough: Run) -> None:
    assert rough.summary["rejoins"] >= 1
    result = audit(rough.path)
    assert result.passed, result.leaks + result.gaps
    assert result.rejoin_bytes > 0
    assert result.counted.erased > 10
    assert result.counted.symbols_late is not None
    assert result.counted.symbols_late > 0


@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("usual-1000baud", {"duration_s": 3.0}),
        ("static-10baud", {}),
        ("open-loop-zoom-10baud", {"channel.delivery": "end"}),
    ],
)
def test_words_of_many_symbols_and_other_coders_pass(
    tmp_path: Path, preset: str, settings: dict[str, object]
) -> None:
    run = flown(tmp_path / "run", preset, **{k.replace(".", "__"): v for k, v in settings.items()})
    result = audit(run.path)
    assert result.passed, result.leaks + result.gaps


def test_a_recording_of_before_passes(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", "servo-10baud", duration_s=4.0)
    signals = json.loads(run.metadata["signals"])
    assert signals.pop("picture") == "dial"
    signals["outputs"] = [{"name": "output_1"}]

    def of_before(row: Row) -> list[Row]:
        about = {"about": None} if "about" in row else {}
        return [{**row, "range": [0.5, 0.5], **about}]

    path = run.path
    for end in ("transmitter", "receiver"):
        text = json.dumps(signals)
        path = doctored(path, tmp_path / end, end, "sample", of_before, signals=text)
    result = audit(path)
    assert result.passed, result.leaks + result.gaps
    signals["states"][1]["unit"] = "V"
    old = ("transmitter", "sample", lambda row: [row])
    result = audit(doctored(path, tmp_path / "other", *old, signals=json.dumps(signals)))
    assert "transmitter: head, signals: it is another" in told(result)


def test_a_serial_line_in_real_time_passes_too(tmp_path: Path) -> None:
    flight = ("--link", "serial", "--clock", "real", "--duration", "3", "--out", "run")
    assert run_command("demo", "--json", *flight, cwd=tmp_path).code == 0
    result = audit(tmp_path / "run")
    assert result.passed, result.leaks + result.gaps
    counted = result.counted
    # A busy machine may hold an end up past a slot, which then carries no symbol.
    assert 30 - counted.erased <= counted.symbols_sent == counted.symbol_bytes <= 30


# What was doctored, and what the audit must say


def test_an_extra_symbol_in_a_slot_is_found(clean: Run, tmp_path: Path) -> None:
    def twice(row: Row) -> list[Row]:
        return [row, row] if row["slot"] == 50 else [row]

    result = leaks_of(clean, tmp_path, "transmitter", "symbol", twice)
    assert "slot 50, field slot: two symbols left in this slot" in told(result)
    assert "the summary's coder_bits_up is another: 80 said, 81 recorded" in told(result)


def test_a_second_symbol_taken_in_a_slot_is_found(clean: Run, tmp_path: Path) -> None:
    def twice(row: Row) -> list[Row]:
        return [row, row] if row["slot"] == 50 else [row]

    result = leaks_of(clean, tmp_path, "receiver", "symbol", twice)
    assert "slot 50, field slot: two symbols were taken in this slot" in told(result)


def test_a_symbol_that_left_too_early_is_found(clean: Run, tmp_path: Path) -> None:
    def early(row: Row) -> Row:
        return {**row, "left_ns": row["left_ns"] - 3 * MS}

    result = leaks_of(clean, tmp_path, "transmitter", "symbol", at("slot", 31, early))
    assert "slot 31, field left_ns: it left before its slot began: 3.000 ms too early" in told(result)


def test_a_symbol_that_left_when_its_slot_was_over_is_found(clean: Run, tmp_path: Path) -> None:
    def late(row: Row) -> Row:
        return {**row, "left_ns": row["left_ns"] + 100 * MS}

    result = leaks_of(clean, tmp_path, "transmitter", "symbol", at("slot", 31, late))
    assert "slot 31, field left_ns: it left when its slot was over" in told(result)


def test_a_symbol_that_was_there_before_its_slot_is_found(clean: Run, tmp_path: Path) -> None:
    def early(row: Row) -> Row:
        return {**row, "arrived_ns": row["arrived_ns"] - 1}

    result = leaks_of(clean, tmp_path, "receiver", "symbol", at("slot", 31, early))
    assert "slot 31, field arrived_ns: it came before the line could have delivered it" in told(result)


def test_a_symbol_from_nowhere_is_found(clean: Run, tmp_path: Path) -> None:
    result = leaks_of(
        clean, tmp_path, "transmitter", "symbol", lambda row: [] if row["slot"] == 7 else [row]
    )
    assert "slot 7, field slot: it came and never left the transmitter" in told(result)


def test_a_symbol_outside_the_alphabet_is_found(clean: Run, tmp_path: Path) -> None:
    result = leaks_of(
        clean, tmp_path, "receiver", "symbol", at("slot", 9, lambda row: {**row, "symbol": 2})
    )
    assert "slot 9, field symbol: it is not in the coder's alphabet: 2" in told(result)


def test_what_a_word_was_about_cannot_be_left_out_of_a_row(clean: Run, tmp_path: Path) -> None:
    nothing = at("sample", 40, lambda row: {**row, "about": None})
    result = leaks_of(clean, tmp_path, "transmitter", "sample", nothing)
    assert "sample 40, field about: it is not what the symbols give: recorded None" in told(result)


def test_a_late_tick_that_is_marked_as_another_is_named(rough: Run, tmp_path: Path) -> None:
    late = [row["tick"] for row in rough.table("transmitter", "tick").rows if row["late"]]
    # The first after a command, one among others, and the last before a command.
    for tick in (late[0], late[len(late) // 2], late[-1]):
        in_time = at("tick", tick, lambda row: {**row, "late": False})
        result = leaks_of(rough, tmp_path / str(tick), "transmitter", "tick", in_time)
        assert f"tick {tick}, field late: its command had not come, and one was owed" in told(result)


def test_a_gauge_without_any_row_is_missed_row_by_row(clean: Run, tmp_path: Path) -> None:
    result = leaks_of(clean, tmp_path, "transmitter", "gap", lambda row: [])
    wanted = "transmitter: gap, sample 9, field sample: it is missing (the first of 8)"
    assert wanted in result.gaps


def test_a_word_that_is_not_the_symbol_of_its_slot_is_found(clean: Run, tmp_path: Path) -> None:
    other = at("sample", 40, lambda row: {**row, "word": [-row["word"][0]]})
    result = leaks_of(clean, tmp_path, "receiver", "sample", other)
    assert "sample 40, field word: it is not what its slots brought" in told(result)


def test_a_word_with_a_second_symbol_is_found(clean: Run, tmp_path: Path) -> None:
    wider = at("sample", 40, lambda row: {**row, "word": row["word"] * 2})
    result = audit(doctored(clean.path, tmp_path / "run", "receiver", "sample", wider))
    assert not result.passed
    assert "sample 40" in told(result)


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
@pytest.mark.parametrize("field", ["state", "coder", "digest"])
def test_a_state_that_depends_on_something_else_is_found(
    clean: Run, tmp_path: Path, end: str, field: str
) -> None:
    def knows_more(row: Row) -> Row:
        if field == "digest":
            return {**row, "digest": f"{int(row['digest'], 16) ^ 1:016x}"}
        return {**row, field: [row[field][0] * (1.0 + 2.0**-52), *row[field][1:]]}

    result = leaks_of(clean, tmp_path, end, "sample", at("sample", 77, knows_more))
    assert f"{end}: sample, sample 77, field {field}: it is not what the symbols give" in told(result)


def test_a_command_that_does_not_follow_from_the_state_is_found(clean: Run, tmp_path: Path) -> None:
    nudged = at("tick", 500, lambda row: {**row, "command": [0.001, 0.0]})
    result = leaks_of(clean, tmp_path, "receiver", "tick", nudged)
    assert "receiver: tick, tick 500, field command: it is not what the symbols give" in told(result)


def test_an_epoch_that_starts_from_an_unearned_state_is_found(rough: Run, tmp_path: Path) -> None:
    def better(row: Row) -> list[Row]:
        changed = {**row, "state": [row["state"][0] + 0.1, *row["state"][1:]]}
        return [changed] if row["epoch"] else [row]

    result = leaks_of(rough, tmp_path, "receiver", "epoch", better)
    assert "from a state that does not follow from the one before it" in told(result)


def test_a_sabotaged_flight_fails_its_audit(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", receiver__sabotage="sample=60,field=range")
    result = audit(run.path)
    assert "receiver: sample, sample 60, field digest: it is not what the symbols give" in told(result)
    assert any("sabotaged on purpose" in note for note in result.notes)


def test_missing_rows_are_not_taken_for_a_clean_flight(clean: Run, tmp_path: Path) -> None:
    result = leaks_of(
        clean, tmp_path, "receiver", "sample", lambda row: [] if row["sample"] == 20 else [row]
    )
    assert any("lacks sample 20" in gap for gap in result.gaps)


def test_a_recording_without_slots_shows_nothing(clean: Run, tmp_path: Path) -> None:
    result = leaks_of(clean, tmp_path, "transmitter", "symbol", lambda _row: [])
    assert any("no symbols were recorded" in gap for gap in result.gaps)


def test_each_machine_may_have_kept_its_own_end(clean: Run, tmp_path: Path) -> None:
    for name in ("transmitter", "receiver"):
        (tmp_path / name).mkdir()
        for file in (f"{name}.mcap", "config.toml", "summary.json"):
            shutil.copy(clean.path / file, tmp_path / name / file)
    assert audit(tmp_path / "transmitter", tmp_path / "receiver").passed
    for name in ("transmitter", "receiver"):
        alone = audit(tmp_path / name)
        assert alone.passed
        assert any(f"only the {name}'s recording is here" in note for note in alone.notes)
    assert not audit(tmp_path / "transmitter", tmp_path / "receiver").notes
    with pytest.raises(RecordingError, match="both hold"):
        audit(clean.path, tmp_path / "receiver")


def test_a_damaged_recording_is_named_as_such(rough: Run, tmp_path: Path) -> None:
    shutil.copytree(rough.path, tmp_path / "run")  # long enough for several chunks
    path = tmp_path / "run" / "receiver.mcap"
    data = bytearray(path.read_bytes())
    data[len(data) // 4] ^= 1  # in the first chunk; behind it is an index, which nobody needs
    path.write_bytes(data)
    result = audit(tmp_path / "run")
    assert not result.passed
    assert any("receiver.mcap has a hole at" in gap for gap in result.gaps)


def test_another_configuration_than_the_one_flown_is_refused(clean: Run, tmp_path: Path) -> None:
    shutil.copytree(clean.path, tmp_path / "run")
    config = tmp_path / "run" / "config.toml"
    text = config.read_text()
    assert "minimum_range_rad" in text
    config.write_text(
        text.replace("[coder]", "[coder]\ninitial_range_rad = 0.7", 1).replace(
            f"\ninitial_range_rad = {json.dumps(clean.config.coder.initial_range_rad)}",
            "",
            1,  # type: ignore[union-attr]
        )
    )
    with pytest.raises(RecordingError, match=r"coder\.initial_range_rad"):
        audit(tmp_path / "run")


def test_the_command_says_what_it_counted_and_exits_with_the_verdict(
    clean: Run, tmp_path: Path
) -> None:
    done = run_command("audit", str(clean.path), cwd=tmp_path)
    assert done.code == 0, done.out
    for words in (
        "coder bits up       80",
        "by the summary",
        "10.000 measured, 10 paid for",
        "passed",
    ):
        assert words in done.out
    bad = doctored(
        clean.path,
        tmp_path / "bad",
        "receiver",
        "symbol",
        lambda row: [row, row][: 1 + row["slot"] // 79],
    )
    done = run_command("audit", str(bad), cwd=tmp_path)
    assert done.code == 1
    assert "slot 79, field slot: two symbols were taken in this slot" in done.out
    assert "failed: " in done.out
