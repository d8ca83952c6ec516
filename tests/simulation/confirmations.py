"""What is confirmed, against what was flown, over many samples: a small model, random words, no plant.

A confirmation rests on hash bits and weights, not on the model; a model of one state and one tick a
sample gives the most samples for the time. Where the list gives up, it takes the receiver's state.
"""

from __future__ import annotations

import math
import multiprocessing
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from random import Random
from typing import NamedTuple

from channel.codec.codec import ERASED, Codec, Vector, Word
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.downlink.laws import MirroredFeedback
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from channel.codec.laws import FeedbackLaw
from tests.simulation.narrow import Faults
from transmitter.session.narrow.hypotheses import Hypotheses

LAYOUT, BITS = Layout(2, 1, 4), 4
SETPOINT_SAMPLES = 60
BURSTS = Faults(burst_up=(0.01, 0.25), burst_down=(0.01, 0.25))
LINES = {
    "loss 1 %": Faults.both(0.01),
    "loss 5 %": Faults.both(0.05),
    "bursts": BURSTS,
    "flips 1 %": Faults.both(flip=0.01),
}
BLOCK, FIRST_SEED = 20_000, 5001


class Integrator:
    """One state, which is measured; its rate is the command."""

    state_size = correction_size = input_size = 1

    def initial(self) -> Vector:
        return (0.0,)

    def measured(self, state: Vector) -> Vector:
        return state

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return (state[0] + 0.1 * command[0],)


def small_machine() -> TwoWay:
    """Return the state machine of the integrator, with a proportional law in it."""
    coder = ZoomCoder(ZoomParameters(0.1, 0.02, 0.9, 3, gains=((0.6,),), impulse=True))
    law = MirroredFeedback(FeedbackLaw((0.0,), ((1.0,),), ((1.0,),), ((0.0,),)), (2.0,), 0.1)
    ranges = (SetPointRange(0, -1.0, 1.0),)
    scheme = MirroredLaw(law, ranges, 1, BITS, LAYOUT.word_samples(BITS + 3) + 3, LAYOUT)
    return TwoWay(Codec(Integrator(), coder, 1), scheme, LAYOUT, 0, (0.0,), (2.0,), (math.inf,))


class Count(NamedTuple):
    """What was found in some samples."""

    confirmed: int
    wrong: int
    doubted: int
    rejoins: int

    def plus(self, other: Count) -> Count:
        return Count(*[one + two for one, two in zip(self, other, strict=True)])


def counted(faults: Faults, seed: int, samples: int) -> Count:
    """Fly and count."""
    machine, chance = small_machine(), Random(f"words {seed}")
    up, down = faults.up(seed), faults.down(seed)
    hypotheses, state = Hypotheses(machine), machine.initial()
    levels = [chance.uniform(-1.0, 1.0) for _ in range(samples // SETPOINT_SAMPLES + 9)]
    truth: dict[int, tuple[Word, tuple[int, ...], int]] = {}
    confirmed = wrong = doubted = rejoins = 0

    def wanted(tick: int, live: Vector) -> Vector:
        return (levels[tick // SETPOINT_SAMPLES],)

    for sample in range(samples):
        sent = (1,) if chance.random() < 0.5 else (-1,)
        hypotheses.sent(sent)
        word = ERASED if (came := up.carry(sent[0], (-1, 1))) is None else (came,)
        flown, symbols = machine.fly(state, word, wanted)
        truth[sample] = (word, symbols, machine.digest(state))
        state = flown.state
        for done in hypotheses.heard(sample, [down.carry(one, (0, 1)) for one in symbols]):
            same = (done.word, done.symbols, done.digest) == truth.pop(done.sample)
            confirmed += 1
            wrong += not same and done.doubt == 0.0
            doubted += done.doubt > 0.0
        if hypotheses.rejoin is not None:
            rejoins += 1
            hypotheses.restart(state)
            truth.clear()
    return Count(confirmed, wrong, doubted, rejoins)


def count_all(name: str, samples: int, on_block: Callable[[Count], None] | None = None) -> Count:
    """Count over the samples of a line, in two processes; stop at the first wrong confirmation."""
    found = Count(0, 0, 0, 0)
    seeds = range(FIRST_SEED, FIRST_SEED + -(-samples // BLOCK))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, context) as pool:
        for block in pool.map(counted, repeat(LINES[name]), seeds, repeat(BLOCK)):
            found = found.plus(block)
            if on_block is not None:
                on_block(found)
            if found.wrong:
                pool.shutdown(cancel_futures=True)
                break
    return found


if __name__ == "__main__":
    line, wanted = sys.argv[1], int(float(sys.argv[2]))
    count_all(line, wanted, lambda found: print(line, found, flush=True))
