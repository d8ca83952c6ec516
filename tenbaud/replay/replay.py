"""A recorded flight replayed from its symbols alone, and compared with the recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from channel.line.line import bits_per_symbol
from tenbaud.files.whole import make_folder, write_whole
from tenbaud.recording.errors import RecordingError
from tenbaud.replay.control import controller_of, steps_by_hand
from tenbaud.replay.pack import Packed, pack
from tenbaud.replay.record import FlightRecord, epochs_of
from tenbaud.replay.refly import Reflown
from tenbaud.replay.rows import EndRows
from tenbaud.replay.stepped import flown_again
from tenbaud.replay.symbols import Unpacked


@dataclass(frozen=True, slots=True)
class Replayed:
    """The result of a replay."""

    ends: tuple[str, ...]
    """whose recordings were compared"""
    samples: int
    digests_compared: int
    """samples of either end whose digest was compared"""
    differences: list[str]
    """differences, the first of each end and topic; empty: none"""
    packed: Packed
    erased: int
    epochs: int
    steps: tuple[tuple[int, float], ...]
    bits_sent: float
    """that the words consumed were worth"""

    @property
    def equal(self) -> bool:
        """Whether every state and every command is equal to the recording, to the last bit."""
        return not self.differences and self.digests_compared > 0


def replay(record: FlightRecord) -> Replayed:
    """Replay a recorded flight from its symbols and compare."""
    agreement = record.agreement
    _check_shape(record)
    epochs = epochs_of(record)
    steps = steps_by_hand(record)
    flown = list(flown_again(agreement, controller_of(agreement.config, steps), epochs))
    differences, compared = compare(record, flown)
    words = [word for epoch in epochs for word in epoch.words]
    if len(flown) != len(words):
        differences.append(f"{len(words)} samples were recorded, {len(flown)} came of their symbols")
    alphabet = agreement.codec.coder.alphabet
    last = flown[-1].digest if flown else ""
    erased = sum(word is None for word in words)
    bits = (len(words) - erased) * alphabet.symbols_per_word * bits_per_symbol(alphabet)
    return Replayed(
        tuple(record.rows),
        len(flown),
        compared,
        differences,
        pack(agreement, epochs, steps, last),
        erased,
        len(epochs),
        steps,
        bits,
    )


def replay_symbols(unpacked: Unpacked) -> tuple[int, str]:
    """Fly a symbols file; return the number of samples and the digest after the last one."""
    controller = controller_of(unpacked.agreement.config, unpacked.steps)
    samples, digest = 0, ""
    for one in flown_again(unpacked.agreement, controller, unpacked.epochs):
        samples += 1
        digest = one.digest
    return samples, digest


def compare(record: FlightRecord, flown: Sequence[Reflown]) -> tuple[list[str], int]:
    """Return the differences from the recordings, and the number of compared digests."""
    differences: list[str] = []
    compared = 0
    for end, rows in record.rows.items():
        found, count = _compare_samples(end, rows, flown)
        compared += count
        differences += found
    if "receiver" in record.rows:
        differences += _compare_commands(record.rows["receiver"], flown)
    return differences + _compare_symbols(record, flown), compared


def _check_shape(record: FlightRecord) -> None:
    """Raise RecordingError for rows that no node writes."""
    for end, rows in record.rows.items():
        if rows.misfits:
            first = rows.misfits[0]
            raise RecordingError(
                f"The {end}'s recording holds data that no node writes: topic {first.topic}, "
                f"{first.row}, field {first.field}: {first.text}."
            )


def _compare_samples(end: str, rows: EndRows, flown: Sequence[Reflown]) -> tuple[list[str], int]:
    by_sample = rows.topics["sample"].by_key()
    unlike = 0
    first = ""
    compared = 0
    for one in flown:
        row = by_sample.get(one.sample)
        if row is None:
            continue
        compared += 1
        field = _unlike_field(row, one)
        if field is not None:
            unlike += 1
            first = first or f"sample {one.sample}, {field}"
    if not unlike:
        return [], compared
    noun = "state differs" if unlike == 1 else "states differ"
    return [f"{end}: {unlike} {noun} from what the symbols give, first at {first}"], compared


def _unlike_field(row: Any, one: Reflown) -> str | None:
    """Return the first field in which a recorded sample differs, with both values."""
    pairs = (
        ("word", row.word, one.word),
        ("state", row.state, one.model),
        ("coder", row.coder, one.coder),
        ("digest", row.digest, one.digest),
    )
    for name, recorded, computed in pairs:
        if recorded != computed:
            return f"field {name}: recorded {recorded}, computed {computed}"
    return None


def _compare_commands(rows: EndRows, flown: Sequence[Reflown]) -> list[str]:
    by_tick = rows.topics["tick"].by_key()
    unlike, first = 0, ""
    for one in flown:
        for tick, _, live, command in one.ticks:
            row = by_tick.get(tick)
            if row is None:
                continue
            if row.command != command or row.live_state != live:
                unlike += 1
                first = first or f"tick {tick}: recorded {row.command}, computed {command}"
    if not unlike:
        return []
    return [f"receiver: {unlike} commands differ from those of the states, first at {first}"]


def _compare_symbols(record: FlightRecord, flown: Sequence[Reflown]) -> list[str]:
    """Return whether the hash symbols that went down are those of the states."""
    topic = "down_symbols" if record.consumer == "receiver" else "confirmed"
    sent = {row.sample: row.symbols for row in record.rows[record.consumer].topics[topic]}
    unlike = [one for one in flown if one.sample in sent and sent[one.sample] != one.symbols]
    if not unlike:
        return []
    first = unlike[0]
    return [
        f"{record.consumer}: the down symbols of {len(unlike)} sample(s) differ from those of the "
        f"states, first at sample {first.sample}: recorded {sent[first.sample]}, computed "
        f"{first.symbols}"
    ]


def save_symbols(replayed: Replayed, path: Path) -> None:
    """Write the packed flight. Raises WriteError, and RecordingError where the file exists already."""
    if path.exists():
        raise RecordingError(
            f"{path} exists already and is not overwritten. Name another file with --save."
        )
    make_folder(path.parent)
    write_whole(path, replayed.packed.data)


def replay_text(replayed: Replayed) -> str:
    """Return the outcome of a replay."""
    packed = replayed.packed
    size = f"{len(packed.symbols)} bytes of symbols"
    if packed.erasures:
        size += f" and {len(packed.erasures)} that mark {replayed.erased} erasures"
    if packed.down:
        size += f", and {len(packed.down)} bytes of what came down"
    lines = [
        f"{replayed.samples} samples, {replayed.bits_sent:g} bits: the whole flight is {size}",
        f"known in advance: {len(packed.head)} bytes of configuration, packed",
    ]
    if replayed.epochs > 1:
        lines.append(
            f"{replayed.epochs} epochs; rejoins sent {packed.start_bytes} bytes of states down the link"
        )
    if replayed.steps:
        lines.append(f"the set-point was changed manually; {len(replayed.steps)} steps were recorded")
    if replayed.equal:
        whose = "both recordings" if len(replayed.ends) > 1 else f"the {replayed.ends[0]}'s recording"
        lines.append(f"flown again: all {replayed.digests_compared} digests of {whose} are equal")
        if "receiver" in replayed.ends:
            lines[-1] += ", and so are the commands"
    elif replayed.differences:
        lines += ["flown again, it is not the flight that was recorded:"]
        lines += [f"  {difference}" for difference in replayed.differences]
    else:
        lines.append("no state could be compared")
    return "\n".join(lines)
