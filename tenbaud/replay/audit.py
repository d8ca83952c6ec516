"""Whether a flight was flown on what it paid for, shown from its recordings.

Three questions. Did each slot carry at most one symbol, on the grid? Do the states of both ends follow
from symbols and slots alone, so that the same symbols at other times within their deadlines give the
same states? Do the commands, the codec's other input, follow from the states, so that nothing came
down by them that had not gone up? What cannot be shown counts as not shown, and fails too.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from channel.codec.codec import CodecState, Vector
from channel.errors import TenbaudError
from receiver.controllers.base import Controller
from receiver.session.rejoin import carried_to
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.notes import hole_notes, version_notes
from tenbaud.recording.recover import RECOVERED_NOTE
from tenbaud.replay.control import controller_of, recorded_commands, steps_by_hand
from tenbaud.replay.record import Epoch, FlightRecord, epochs_of, load_record
from tenbaud.replay.refly import Reflown
from tenbaud.replay.replay import compare, fly_again
from tenbaud.replay.slots import Counted, check_slots, count

JITTERED_FLIGHTS = 2
JITTER_SEED = 20260


@dataclass(slots=True)
class Audit:
    """What an audit found. `passed` needs no leak and nothing that could not be shown."""

    record: FlightRecord
    counted: Counted
    leaks: list[str] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)
    """what the recordings do not show"""
    notes: list[str] = field(default_factory=list)
    digests_compared: int = 0
    jittered_states: int = 0
    """states that were computed again with other arrival times"""
    rejoin_bytes: int = 0
    """of start states, which went down the link"""

    @property
    def passed(self) -> bool:
        """Whether the flight was shown to rest on its paid symbols alone."""
        return not self.leaks and not self.gaps


def audit(path: Path, other: Path | None = None) -> Audit:
    """Audit the run at `path`; `other` is the folder of the other machine, where each kept its end."""
    record = load_record(path, other)
    result = Audit(record, count(record))
    result.leaks, result.gaps = check_slots(record)
    _check_whole(record, result)
    _check_counts(record, result)
    try:
        epochs = epochs_of(record.consumer, record.agreement)
    except RecordingError as error:
        result.gaps.append(str(error))
        return result
    _check_states(record, epochs, result)
    return result


def _check_whole(record: FlightRecord, result: Audit) -> None:
    if record.transmitter is None:
        result.notes.append("only the receiver's recording is here: when each symbol left is not shown")
    if record.receiver is None:
        result.notes.append(
            "only the transmitter's recording is here: what arrived, and when, is not shown"
        )
    for end, tables in record.ends():
        result.notes += version_notes(tables.path, tables.metadata)
        dropped = int(tables.end.get("rows_dropped", "0"))
        if dropped:
            result.gaps.append(f"the {end}'s recorder dropped {dropped} rows")
        result.gaps += hole_notes(tables.path, tables.holes)
        if not tables.end:
            result.notes.append(f"the {end}'s recording was cut: audited up to the cut")
        if RECOVERED_NOTE in tables.end:
            result.notes.append(f"the {end}'s recording was recovered: audited up to the cut")
    for end, section in (
        ("transmitter", record.agreement.config.transmitter),
        ("receiver", record.agreement.config.receiver),
    ):
        if section.sabotage:
            result.notes.append(f"the {end} was sabotaged on purpose: {section.sabotage}")


def _check_counts(record: FlightRecord, result: Audit) -> None:
    """The summary must claim the coder bits that the recording shows."""
    counted = result.counted
    summary = record.summaries.get("transmitter", {})
    whole = record.transmitter is not None and bool(record.transmitter.end)
    if not whole or counted.symbols_sent is None or "coder_bits_up" not in summary:
        return
    bits = counted.symbols_sent * counted.bits_per_symbol
    if abs(summary["coder_bits_up"] - bits) > 1e-6 * max(1.0, bits):
        result.leaks.append(
            f"the summary says {summary['coder_bits_up']:g} coder bits, the recording holds {bits:g}"
        )


def _check_states(record: FlightRecord, epochs: list[Epoch], result: Audit) -> None:
    commands = recorded_commands(record)
    try:
        rebuilt: Controller | None = _controller(record)
    except (TenbaudError, ValueError) as error:
        rebuilt = None
        result.gaps.append(f"whether the commands follow from the states: {error}")
    flown: list[Reflown] = []
    if rebuilt is not None:
        flown = fly_again(record, rebuilt, epochs, lambda _slot: 0)
        found, result.digests_compared = compare(record, flown)
        if found and commands is not None:
            # Which of the two is it? With the recorded commands only the codec is left.
            alone = fly_again(record, commands, epochs, lambda _slot: 0)
            states, _ = compare(record, alone)
            if not states:
                found.append(
                    "given the recorded commands the states do follow from the symbols: it is the "
                    "controller that used something else than the states and the set-point"
                )
        result.leaks += found
    elif commands is not None:
        flown = fly_again(record, commands, epochs, lambda _slot: 0)
        found, result.digests_compared = compare(record, flown)
        result.leaks += found
    if not flown or not result.digests_compared:
        result.gaps.append("no state could be compared with a recorded one")
        return
    _check_length(epochs, flown, result)
    _check_starts(record, epochs, flown, result)
    _check_jitter(record, epochs, flown, result)


def _controller(record: FlightRecord) -> Controller:
    return controller_of(record.agreement.config, steps_by_hand(record))


def _check_length(epochs: list[Epoch], flown: Sequence[Reflown], result: Audit) -> None:
    words = sum(len(epoch.words) for epoch in epochs)
    if words != len(flown):
        result.leaks.append(f"{words} samples were recorded, {len(flown)} came of their symbols")


def _check_jitter(
    record: FlightRecord, epochs: list[Epoch], flown: Sequence[Reflown], result: Audit
) -> None:
    """Fly again with the symbols at other times within their deadlines: nothing may change."""
    allowance_ns = record.agreement.terms.deadline_allowance_ns
    expected = [one.digest for one in flown]
    # Given what each flight commanded, so that a controller without a place here is no hindrance.
    for seed in range(JITTERED_FLIGHTS):
        noise = random.Random(JITTER_SEED + seed)
        delay = partial(_within, noise, allowance_ns)
        repeated = _Repeated(flown, record.agreement.terms.initial_command)
        again = fly_again(record, repeated, epochs, delay)
        digests = [one.digest for one in again]
        if digests != expected:
            at = next(
                (
                    one.sample
                    for one, other in zip(flown, again, strict=False)
                    if one.digest != other.digest
                ),
                len(digests),
            )
            result.leaks.append(f"other arrival times give another state, first after sample {at}")
        result.jittered_states += len(digests)


def _within(noise: random.Random, allowance_ns: int, slot: int) -> int:
    return noise.randint(0, allowance_ns)


class _Repeated:
    """A `Controller` that commands what an earlier flight commanded."""

    def __init__(self, flown: Sequence[Reflown], initial: Vector) -> None:
        self._commands = {tick: command for one in flown for tick, _, _, command in one.ticks}
        self._initial = initial

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the earlier command of `tick`."""
        return self._commands.get(tick, self._initial)

    def reference_rad(self, tick: int) -> None:
        """Return None: nothing is followed."""
        return None


def _check_starts(
    record: FlightRecord, epochs: list[Epoch], flown: Sequence[Reflown], result: Audit
) -> None:
    """Every epoch must start from the initial state, or from the one before it carried on.

    Only the receiver knows how far it had come; a transmitter's recording alone cannot show it.
    """
    codec, lead = record.agreement.codec, record.agreement.terms.lead_ticks
    last: dict[int, Reflown] = {one.epoch: one for one in flown}
    commands: dict[int, list[Vector]] = {}
    for one in flown:
        commands.setdefault(one.epoch, []).extend(command for _, _, _, command in one.ticks)
    before: tuple[CodecState, list[Vector]] | None = None
    for epoch in epochs:
        initial = codec.initial()._replace(sample=epoch.start.sample)
        if epoch.start != initial:
            result.rejoin_bytes += len(codec.pack(epoch.start))
            if before is None or record.receiver is None:
                result.gaps.append(
                    f"epoch {epoch.number} starts from a state whose past is not recorded here"
                )
            elif not _is_carried(record, epoch, *before):
                result.leaks.append(
                    f"epoch {epoch.number} starts at sample {epoch.start.sample} from a state "
                    "that does not follow from the one before it"
                )
        reached = last.get(epoch.number)
        known = ([epoch.hold] * lead + commands.get(epoch.number, []))[-lead:] if lead else []
        state = epoch.start
        if reached is not None:
            state = CodecState(reached.sample + 1, reached.model, reached.coder)
        before = (state, known)


def _is_carried(record: FlightRecord, epoch: Epoch, state: CodecState, known: list[Vector]) -> bool:
    codec = record.agreement.codec
    carried = carried_to(codec, state, epoch.start.sample, known, epoch.hold, 0)
    # After a long pause the coder starts anew.
    return epoch.start in (carried, carried._replace(coder=codec.coder.initial()))
