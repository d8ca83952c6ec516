"""A recorded flight replayed from its symbols alone, and compared with the recording."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from channel.line.line import bits_per_symbol
from tenbaud.files.whole import make_folder, write_whole
from tenbaud.recording.errors import RecordingError
from tenbaud.replay.control import controller_of, steps_by_hand
from tenbaud.replay.pack import Packed, pack
from tenbaud.replay.record import FlightRecord, epochs_of
from tenbaud.replay.refly import Reflown, flown_again
from tenbaud.replay.rows import Topic
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
        count, unlike = _unlike(
            rows.topics["sample"],
            (
                (
                    one.sample,
                    {"word": one.word, "state": one.model, "coder": one.coder, "digest": one.digest},
                )
                for one in flown
            ),
        )
        compared += count
        if unlike:
            noun = "state differs" if len(unlike) == 1 else "states differ"
            differences.append(
                f"{end}: {len(unlike)} {noun} from what the symbols give, first at sample {unlike[0]}"
            )
    if "receiver" in record.rows:
        ticks = (tick for one in flown for tick in one.ticks)
        decided = ((tick, {"command": command, "live_state": live}) for tick, _, live, command in ticks)
        _, unlike = _unlike(record.rows["receiver"].topics["tick"], decided)
        if unlike:
            differences.append(
                f"receiver: {len(unlike)} commands differ from those of the states, first at tick "
                f"{unlike[0]}"
            )
    down = record.rows[record.consumer].topics[
        "down_symbols" if record.consumer == "receiver" else "confirmed"
    ]
    _, unlike = _unlike(down, ((one.sample, {"symbols": one.symbols}) for one in flown))
    if unlike:
        differences.append(
            f"{record.consumer}: the down symbols of {len(unlike)} sample(s) differ from those of the "
            f"states, first at sample {unlike[0]}"
        )
    return differences, compared


def _unlike(topic: Topic, computed: Iterable[tuple[int, dict[str, Any]]]) -> tuple[int, list[str]]:
    """Return how many rows were compared with what was computed, and those that differ.

    Each of these as its key and the first field that differs, with both values.
    """
    rows, compared = topic.by_key(), 0
    unlike: list[str] = []
    for key, values in computed:
        row = rows.get(key)
        if row is None:
            continue
        compared += 1
        for name, value in values.items():
            recorded = getattr(row, name)
            if recorded != value:
                unlike.append(f"{key}, field {name}: recorded {recorded}, computed {value}")
                break
    return compared, unlike


def _check_shape(record: FlightRecord) -> None:
    """Raise RecordingError for rows that no node writes."""
    for end, rows in record.rows.items():
        if rows.misfits:
            first = rows.misfits[0]
            raise RecordingError(
                f"The {end}'s recording holds data that no node writes: topic {first.topic}, "
                f"{first.row}, field {first.field}: {first.text}."
            )


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
