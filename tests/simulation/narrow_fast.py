"""The state machine of the pitch axis with the paper's law, its ticks compiled: for long flights.

The functions are those of the nodes, compiled as studies compile them; a test compares the bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from channel.codec.codec import Vector, Word
from channel.codec.downlink.laws import MirroredPid
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState, Wanted
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from channel.codec.laws import pid_command
from channel.codec.models.pitch import PitchModel, pitch_tick
from tenbaud.studies.compiled import compiled
from tests.simulation.narrow import LIMITS, NO_SLEW, START, TICKS, paper_law, tuned_codec


def sample_kernel(
    model: Any,
    known: Any,
    lead: int,
    count: int,
    memory: Any,
    target: float,
    constants: Any,
    loops: Any,
    limits: Any,
    bias: Any,
    errors: Any,
    rates: Any,
    commands: Any,
) -> Any:
    """Fly the ticks of a sample; return the model's state after it, and whether all is well."""
    closed = model
    well = True
    for index in range(count + lead):
        if index == count:
            closed = model
        if index < lead:
            front, rear = known[index, 0], known[index, 1]
        else:
            errors[0] = target - model[0]
            rates[0] = model[1]
            wanted = commands[index - lead]
            wanted[0] = bias[0]
            wanted[1] = bias[1]
            well = pid_command(loops, memory, errors, rates, limits, wanted) and well
            front, rear = wanted[0], wanted[1]
        model = pitch_tick(model, (front, rear), (0.0, 0.0), constants)
    if lead == 0:
        closed = model
    return closed, well


class FastTwoWay(TwoWay):
    """As `TwoWay`, without the states of a sample's ticks."""

    def __init__(self, scheme: MirroredLaw, law: MirroredPid, layout: Layout, lead_ticks: int) -> None:
        super().__init__(tuned_codec(), scheme, layout, lead_ticks, START, LIMITS, NO_SLEW)
        assert isinstance(self.codec.model, PitchModel)
        self._constants = self.codec.model.constants
        self._loops = law._constants
        self._law_size = len(law.initial())
        self._kernel = compiled(sample_kernel)
        self._work = (np.array(LIMITS), np.array(START), np.zeros(1), np.zeros(1))

    def _flown(
        self,
        state: TwoWayState,
        digest: int,
        word: Word,
        symbols: Sequence[int | None],
        consume: Callable[[int, Vector, Vector], Vector],
        ask: Wanted | None,
    ) -> TwoWaySample:
        opened = self.codec.open(state.codec, word)
        tick = state.codec.sample * TICKS + self.lead_ticks
        down = self.scheme.settle(consume(tick, (), state.down))
        memory = np.array(down[-self._law_size : -self._law_size + 1])
        known = np.array(state.commands).reshape(self.lead_ticks, 2)
        commands = np.empty((TICKS, 2))
        closed, well = self._kernel(
            opened.model,
            known,
            self.lead_ticks,
            TICKS,
            memory,
            down[0],
            self._constants,
            self._loops,
            *self._work,
            commands,
        )
        if not well:
            raise ValueError("the law was given a state that is not finite")
        decided: list[Vector] = [(front, rear) for front, rear in commands.tolist()]
        following = (*state.commands, *decided)[TICKS:]
        after = self.codec.close(state.codec, opened, closed)
        law = (*memory.tolist(), 0.0, 1.0)
        down = down[: -self._law_size] + law
        owed = self._owed(state, digest, word, symbols)
        return TwoWaySample(TwoWayState(after, following, decided[-1], down, owed), decided, [], [])


def fast_mirrored(layout: Layout, queue: int, lead_ticks: int = 0, bits: int = 9) -> FastTwoWay:
    """Return what `tests.simulation.narrow.mirrored` does, compiled."""
    law = paper_law()
    ranges: Sequence[SetPointRange] = (SetPointRange(0, -2.0, 2.0),)
    scheme = MirroredLaw(law, ranges, 1, bits, queue, layout)
    return FastTwoWay(scheme, law, layout, lead_ticks)
