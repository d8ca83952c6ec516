"""Every change of a recording is found, or is of a field that carries no claim, for a reason."""

from __future__ import annotations

import random
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from channel.errors import TenbaudError
from tenbaud.audit.audit import Audit, audit, audit_record
from tenbaud.audit.base import FILED, Evidence
from tenbaud.audit.table import CLAIMS
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.kinds import KINDS
from tenbaud.recording.reader import Recording
from tenbaud.replay.record import FlightRecord, load_record
from tenbaud.replay.replay import replay
from tenbaud.replay.rows import read_rows
from tests.tenbaud.audit.mutations import Mutation, Original, write_recording
from tests.tenbaud.audit.unclaimed import ORDER, UNCLAIMED, reason_for
from tests.tenbaud.flown import flown
from tests.tenbaud.replay.test_old_recordings import TWO_EPOCHS

SEED = 20261126
AS_IN_ANY_FLIGHT = frozenset({"symbol", "epoch", "event", "estimate", "gap"})
"""Topics with the same claims for any downlink; the long tests change them in narrow flights too."""
SHARE_MIN = 0.85
"""Of all changes, those that are found; the others are of fields that carry no claim."""


def mutant(record: FlightRecord, mutation: Mutation, path: Path) -> FlightRecord:
    """Return the record of a run of which one recording is another; the rest need not be read anew."""
    tables = Recording(path)
    rows = {**record.rows, mutation.end: read_rows(mutation.end, tables)}
    return replace(record, tables={**record.tables, mutation.end: tables}, rows=rows)


def is_named(mutation: Mutation, original: Original, result: Audit) -> bool:
    """Whether a finding names topic and row, and the field if one was changed."""
    row = original.row(mutation)
    key = KINDS[mutation.end][mutation.topic].channel.fields[0].name
    named = (mutation.topic, mutation.topic.replace("_", " "))
    lines = [line for line in result.leaks + result.gaps if any(one in line for one in named)]
    # Of rows that nothing else tells of, it is their number that is wrong.
    lines += [line for line in result.leaks + result.gaps if "all rows" in line]
    # Of swapped rows either may be named, and a row whose key was changed has another name now; an
    # event is named by its time or, where there are too few or too many of a kind, by that.
    if mutation.kind == "swap" or mutation.field in (key, "epoch") or mutation.topic == "event":
        return bool(lines)
    names = [f"{key} {row[key]}", f"row {mutation.row}"]
    if mutation.topic == "epoch":
        names += [f"epoch {row['epoch']}", "lacks the epoch", "first epoch"]
    if row.get("taken") is False and mutation.kind in ("delete", "double"):
        names.append("all rows")  # it came too late, and no other row tells of it
    return any(name in line for line in lines for name in names)


def survey(
    run: Path, path: Path, rows_per_topic: int, without: frozenset[str] = frozenset()
) -> tuple[int, int, list[str]]:
    """Return how many changes there were, how many were found, and those that should have been.

    No row of the topics `without` is changed. `path`: where the changed recordings are written.
    """
    original, noise = Original(run), random.Random(SEED)
    record = load_record(run)
    evidence = Evidence(record)
    assert audit_record(record).passed
    tried = found = 0
    missed: list[str] = []
    for mutation in original.mutations(rows_per_topic, noise):
        if mutation.topic in without:
            continue
        tried += 1
        original.write(mutation, path, noise)
        try:
            result = audit_record(mutant(record, mutation, path))
        except TenbaudError as error:
            found += 1
            if mutation.topic not in str(error):
                missed.append(f"not named: {mutation}: {error}")
            continue
        if not result.passed:
            found += 1
            if not is_named(mutation, original, result):
                missed.append(f"not named: {mutation}: {(result.leaks + result.gaps)[:2]}")
            continue
        row = evidence.topic(mutation.end, mutation.topic).rows[mutation.row]
        field = mutation.field or ORDER
        if reason_for(mutation.end, mutation.topic, field, row, evidence) is None:
            missed.append(f"not found: {mutation}: {row}")
    return tried, found, missed


def test_every_change_of_a_flight_is_found(tmp_path: Path) -> None:
    tried, found, missed = survey(TWO_EPOCHS, tmp_path / "mutant.mcap", 1)
    assert tried > 110
    assert not missed, "\n".join([f"seed {SEED}", *missed])
    assert found > SHARE_MIN * tried


def test_every_change_of_a_narrow_flight_is_found(tmp_path: Path) -> None:
    narrow = {"channel__downlink": "narrow", "link__impairments": "loss=0.05"}
    run = flown(tmp_path / "run", duration_s=2.0, **narrow)
    tried, found, missed = survey(run.path, tmp_path / "mutant.mcap", 1, AS_IN_ANY_FLIGHT)
    assert tried > 60
    assert not missed, "\n".join([f"seed {SEED}", *missed])
    assert found > SHARE_MIN * tried


@pytest.mark.soak
@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("tuned-10baud", {"channel__downlink": "narrow", "link__impairments": "loss=0.1,flip=0.01"}),
        ("tuned-10baud", {"channel__downlink": "narrow", "downlink__scheme": "coded"}),
        ("tuned-10baud", {"link__impairments": "loss=0.2,up:flip=0.05,delay=20ms±10ms,duplicate=0.1"}),
        ("tuned-10baud", {"link__impairments": "cut=3s+1.5s", "timing__lead_ticks": 5}),
        ("usual-1000baud", {"duration_s": 2.0, "link__impairments": "loss=0.002"}),
        ("static-10baud", {}),
    ],
)
def test_every_change_of_many_flights_is_found(
    tmp_path: Path, preset: str, settings: dict[str, object]
) -> None:
    run = flown(tmp_path / "run", preset, **{"duration_s": 8.0, **settings})
    _, _, missed = survey(run.path, tmp_path / "mutant.mcap", 6)
    assert not missed, "\n".join([f"seed {SEED}", *missed])


def test_each_field_is_owned_by_a_claim_or_listed_with_a_reason() -> None:
    every = {
        (end, topic, name)
        for end, topics in KINDS.items()
        for topic, kind in topics.items()
        for name in (*(field.name for field in kind.channel.fields), FILED)
    }
    owned = set().union(*(claim.fields for claim in CLAIMS))
    listed = {(one.end, one.topic, name) for one in UNCLAIMED for name in one.fields if name != ORDER}
    assert owned | listed == every
    assert all(len(one.why) > 5 for one in UNCLAIMED)


def test_the_records_have_the_fields_that_the_nodes_write() -> None:
    for topics in KINDS.values():
        for topic, kind in topics.items():
            names = tuple(field.name for field in kind.channel.fields)
            assert (kind.channel.topic, kind.record._fields) == (topic, names)


def test_a_row_that_no_node_writes_is_reported_by_row_and_field(tmp_path: Path) -> None:
    original = Original(TWO_EPOCHS)
    wrong: list[tuple[str, str, object]] = [
        ("sample", "range", None),
        ("sample", "arrival_s", None),
        ("event", "kind", None),
        ("symbol", "slot", -1),
    ]
    for topic, field, value in wrong:
        folder = tmp_path / f"{topic} {field} {value}"
        shutil.copytree(TWO_EPOCHS, folder)
        messages = list(original.messages["receiver"])
        at = original.rows("receiver", topic)[1]
        messages[at] = (topic, messages[at][1], {**messages[at][2], field: value})
        write_recording(folder / "receiver.mcap", messages, original.streams["receiver"])
        result = audit(folder)
        assert any(f"row 1, field {field}" in one for one in result.gaps)
        with pytest.raises(RecordingError, match=f"row 1, field {field}"):
            replay(load_record(folder))


# What was passed before


def doctor(tmp_path: Path, end: str, keep: object) -> Audit:
    """Audit the old recording without some rows of an end: those that `keep` says no to."""
    original = Original(TWO_EPOCHS)
    folder = tmp_path / "doctored"
    shutil.copytree(TWO_EPOCHS, folder)
    messages = [one for one in original.messages[end] if keep(one[0], one[2])]  # type: ignore[operator]
    write_recording(folder / f"{end}.mcap", messages, original.streams[end])
    (folder / "summary.json").unlink()
    return audit(folder)


def test_deleted_commands_are_missed(tmp_path: Path) -> None:
    result = doctor(tmp_path, "receiver", lambda topic, _row: topic != "tick")
    assert any("receiver: tick, tick 5, field tick: it is missing" in one for one in result.gaps)


def test_deleted_samples_are_missed(tmp_path: Path) -> None:
    def keep(topic: str, row: dict[str, object]) -> bool:
        return topic not in ("sample", "estimate") or not 10 <= row.get("sample", 0) < 20  # type: ignore[operator]

    for end in ("transmitter", "receiver"):
        result = doctor(tmp_path / end, end, keep)
        assert any("sample 10" in one for one in result.gaps), result.gaps


def test_a_recorder_that_lost_rows_fails_the_audit(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(TWO_EPOCHS, folder)
    text = (folder / "summary.json").read_text()
    assert '"recording_rows_lost": 0' in text
    (folder / "summary.json").write_text(
        text.replace('"recording_rows_lost": 0', '"recording_rows_lost": 21990')
    )
    result = audit(folder)
    assert any("the summary says that rows were lost: 21990" in one for one in result.gaps)


def test_fewer_rows_than_were_written_fail_the_audit(tmp_path: Path) -> None:
    record = load_record(TWO_EPOCHS)
    receiver = record.tables["receiver"]
    receiver.end["rows_written"] = "999"
    result = audit_record(record)
    assert any("of 999 that were written" in one for one in result.gaps)
