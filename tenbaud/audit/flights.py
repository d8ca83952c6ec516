"""The starts of epochs, and the independence from arrival times within the deadlines."""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import partial

from channel.codec.codec import CodecState, Vector
from receiver.session.rejoin import carried_to
from tenbaud.audit.base import Claim, Evidence, Findings, Place
from tenbaud.replay.record import Epoch
from tenbaud.replay.refly import Reflown, refly

JITTERED_FLIGHTS = 2
JITTER_SEED = 20260


def check_starts(evidence: Evidence, findings: Findings) -> None:
    """Every epoch starts from the initial state, or from the one before it carried on.

    Only the receiver knows how far it had come; a transmitter's recording alone cannot show it.
    """
    agreement = evidence.agreement
    codec, lead = agreement.codec, agreement.terms.lead_ticks
    flown: dict[int, list[Reflown]] = {}
    for one in evidence.flown:
        flown.setdefault(one.place, []).append(one)
    before: tuple[CodecState, list[Vector], Vector] | None = None
    for index, epoch in enumerate(evidence.epochs):
        place = Place(_consumer(evidence), "epoch", f"epoch {epoch.number}")
        is_initial = epoch.start == codec.initial()._replace(sample=epoch.start.sample)
        if not is_initial:
            if before is None or evidence.end("receiver") is None:
                findings.gap(
                    place._replace(field="state"),
                    "it starts from a state whose past is not recorded here",
                )
            elif not _is_carried(evidence, epoch, *before[:2]):
                findings.leak(
                    place._replace(field="state"),
                    "it starts from a state that does not follow from the one before it",
                    f"sample {epoch.start.sample}",
                )
        allowed = [agreement.terms.initial_command] if is_initial else []
        if before is not None:
            allowed.append(before[2])
        known_past = before is not None or is_initial
        if known_past and evidence.end("receiver") is not None and epoch.hold not in allowed:
            findings.leak(
                place._replace(field="hold"),
                "the command before it was another",
                f"{epoch.hold}, not {' or '.join(map(str, allowed))}",
            )
        samples = flown.get(index, [])
        commands = [command for one in samples for _, _, _, command in one.ticks]
        known = ([epoch.hold] * lead + commands)[-lead:] if lead else []
        state = epoch.start
        if samples:
            state = CodecState(samples[-1].sample + 1, samples[-1].model, samples[-1].coder)
        before = (state, known, commands[-1] if commands else epoch.hold)


def check_jitter(evidence: Evidence, findings: Findings) -> None:
    """Flown again with the symbols at other times within their deadlines, nothing changes."""
    flown = evidence.flown
    if not flown:
        return
    terms = evidence.agreement.terms
    expected = [one.digest for one in flown]
    # Given what each flight commanded, so that a controller without a place here is no hindrance.
    for seed in range(JITTERED_FLIGHTS):
        noise = random.Random(JITTER_SEED + seed)
        delay = partial(_within, noise, terms.deadline_allowance_ns)
        repeated = _Repeated(flown, terms.initial_command)
        again = list(refly(evidence.agreement, repeated, evidence.epochs, delay))
        digests = [one.digest for one in again]
        if digests != expected:
            pairs = zip(flown, again, strict=False)
            at = next((one.sample for one, two in pairs if one.digest != two.digest), len(digests))
            findings.leak(
                Place(_consumer(evidence), "sample", f"sample {at}", "digest"),
                "other arrival times give another state",
            )
        evidence.jittered_states += len(digests)


def check_length(evidence: Evidence, findings: Findings) -> None:
    """As many samples come of the words as were recorded."""
    words = sum(len(epoch.words) for epoch in evidence.epochs)
    if evidence.flown and words != len(evidence.flown):
        findings.leak(
            Place(_consumer(evidence), "sample", "all samples"),
            "not all come of their symbols",
            f"{len(evidence.flown)} of {words}",
        )


def _consumer(evidence: Evidence) -> str:
    return "receiver" if evidence.end("receiver") is not None else "transmitter"


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

    def references(self, tick: int) -> tuple[float | None, ...]:
        """Return none: nothing is followed."""
        return ()


def _is_carried(evidence: Evidence, epoch: Epoch, state: CodecState, known: list[Vector]) -> bool:
    codec = evidence.agreement.codec
    carried = carried_to(codec, state, epoch.start.sample, known, epoch.hold, 0)
    # After a long pause the coder starts anew.
    return epoch.start in (carried, carried._replace(coder=codec.coder.initial()))


STARTS = Claim(
    "epochs start from what was before",
    check_starts,
    (("receiver", "epoch", ("sample", "state", "coder", "hold")),),
)
JITTER = Claim("arrival times within the deadlines do not matter", check_jitter, ())
LENGTH = Claim("every word was flown", check_length, ())
