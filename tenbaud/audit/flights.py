"""The starts of epochs, and the independence from arrival times within the deadlines."""

from __future__ import annotations

import random
from typing import NamedTuple

from channel.codec.codec import ERASED, CodecState, Vector
from channel.codec.downlink.machine import TwoWayState
from receiver.controllers.base import Controller
from receiver.session.rejoin import carried_to
from tenbaud.audit.base import Evidence, claim
from tenbaud.replay.control import RecordedCommands
from tenbaud.replay.pack import Epoch
from tenbaud.replay.refly import Reflown, refly

JITTERED_FLIGHTS = 2
JITTER_SEED = 20260


class _Before(NamedTuple):
    """Where an epoch ended."""

    state: CodecState
    known: list[Vector]
    """commands of the next ticks"""
    hold: Vector
    both: TwoWayState | None
    """of a narrow downlink"""


@claim("every word was flown")
def check_length(evidence: Evidence) -> None:
    """As many samples come of the words as were recorded."""
    words = sum(len(epoch.words) for epoch in evidence.epochs)
    if evidence.flown and words != len(evidence.flown):
        place = evidence.at(evidence.record.consumer, "sample", "all samples")
        place.leak("", "not all come of their symbols", f"{len(evidence.flown)} of {words}")


@claim("epochs start from what was before", ("receiver", "epoch", "sample", "state", "coder", "hold"))
def check_starts(evidence: Evidence) -> None:
    """Every epoch starts from the initial state, or from the one before it carried on.

    Only the receiver knows how far it had come; a transmitter's recording alone cannot show it.
    """
    codec, terms = evidence.agreement.codec, evidence.terms
    lead, has_receiver = terms.lead_ticks, "receiver" in evidence.rows
    flown: dict[int, list[Reflown]] = {}
    for one in evidence.flown:
        flown.setdefault(one.place, []).append(one)
    before: _Before | None = None
    for index, epoch in enumerate(evidence.epochs):
        place = evidence.at(evidence.record.consumer, "epoch", f"epoch {epoch.number}")
        is_initial = epoch.start == codec.initial()._replace(sample=epoch.start.sample)
        carried: TwoWayState | None = None
        if not is_initial and (before is None or not has_receiver):
            place.gap("state", "it starts from a state whose past is not recorded here")
        elif not is_initial and before is not None:
            carried = _carried_on(evidence, epoch, before)
            if not _is_carried(evidence, epoch, before, carried):
                what = "it starts from a state that does not follow from the one before it"
                place.leak("state", what, f"sample {epoch.start.sample}")
        allowed = [terms.initial_command] if is_initial else []
        if before is not None:
            allowed.append(before.hold)
        if carried is not None:
            # The law of a narrow downlink goes on while no symbols come.
            allowed.append(carried.hold)
        if allowed and has_receiver and epoch.hold not in allowed:
            detail = f"{epoch.hold}, not {' or '.join(map(str, allowed))}"
            place.leak("hold", "the command before it was another", detail)
        samples = flown.get(index, [])
        commands = [command for one in samples for _, _, _, command in one.ticks]
        known = ([epoch.hold] * lead + commands)[-lead:] if lead else []
        state, both = epoch.start, epoch.two_way
        if samples:
            last = samples[-1]
            state = CodecState(last.sample + 1, last.model, last.coder)
            both = last.both and last.both.state
        before = _Before(state, known, commands[-1] if commands else epoch.hold, both)


@claim("arrival times within the deadlines do not matter")
def check_jitter(evidence: Evidence) -> None:
    """Flown again with the symbols at other times within their deadlines, nothing changes."""
    flown, terms = evidence.flown, evidence.terms
    if not flown:
        return
    expected = [one.digest for one in flown]
    # Given what each flight commanded, so that a controller without a place here is no hindrance.
    commands = {tick: command for one in flown for tick, _, _, command in one.ticks}
    # What a narrow downlink sent follows from the controller: `tenbaud.audit.downlink` flies it.
    for seed in range(JITTERED_FLIGHTS if evidence.agreement.two_way is None else 0):
        again = jittered(evidence, RecordedCommands(commands, terms.initial_command, {}), seed)
        digests = [one.digest for one in again]
        if digests != expected:
            pairs = zip(flown, again, strict=False)
            at = next((one.sample for one, two in pairs if one.digest != two.digest), len(digests))
            place = evidence.at(evidence.record.consumer, "sample", f"sample {at}")
            place.leak("digest", "other arrival times give another state")
        evidence.jittered_states += len(digests)


def jittered(evidence: Evidence, controller: Controller, seed: int) -> list[Reflown]:
    """Return the flight, flown again with its symbols at other times within their deadlines."""
    noise, most_ns = random.Random(JITTER_SEED + seed), evidence.terms.deadline_allowance_ns

    def delay(_slot: int) -> int:
        return noise.randint(0, most_ns)

    again = evidence.walk.again()
    return list(refly(evidence.agreement, controller, evidence.epochs, delay, again))


def _is_carried(evidence: Evidence, epoch: Epoch, before: _Before, both: TwoWayState | None) -> bool:
    codec, machine = evidence.agreement.codec, evidence.agreement.two_way
    anew = codec.coder.initial()  # after a long pause the coder starts anew
    if machine is None:
        carried = carried_to(codec, before.state, epoch.start.sample, before.known, epoch.hold, 0)
        return epoch.start in (carried, carried._replace(coder=anew))
    return both is not None and epoch.two_way in (
        both,
        both._replace(codec=both.codec._replace(coder=anew)),
    )


def _carried_on(evidence: Evidence, epoch: Epoch, before: _Before) -> TwoWayState | None:
    """Return the state before an epoch, advanced to it without symbols; None for another downlink."""
    machine, both = evidence.agreement.two_way, before.both
    while machine is not None and both is not None and both.sample < epoch.start.sample:
        both = machine.step(both, ERASED, (None,) * machine.commands_in(both)).state
    return both
