"""The commander of the narrow downlink: down symbols of the two-way state machine, and nothing else.

The machine's state X is here, and it is the truth: it follows from the words consumed and the symbols
sent, whatever the transmitter knows of them (`channel.codec.downlink.machine`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from channel.codec.codec import ERASED, CodecState, Vector, Word, is_coder_state
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState
from channel.codec.downlink.mirrored import MirroredLaw
from channel.codec.lead import FlownSample
from channel.errors import CodecDiverged
from channel.protocol.frames import DownSymbol, Frame
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder, write_down_symbols, write_epoch, write_two_way
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.commander import UNWRITTEN_MAX, Begins, Standing, Start
from receiver.session.records import write_commands, write_sample
from receiver.session.rejoin import KEEP_CODER_SAMPLES


class _Flown(NamedTuple):
    before: TwoWayState
    word: Word
    symbols: Sequence[int]
    flown: TwoWaySample
    now_ns: int


class NarrowCommander:
    """A `Commander`; see the module's text."""

    def __init__(
        self, machine: TwoWay, terms: Terms, asker: Asker, recorder: Recorder, begins: Begins | None
    ) -> None:
        self.machine = machine
        self.two_way_state = machine.initial()
        """X before the next sample"""
        self.history = History(machine.codec, 2 * terms.history_samples)
        self._terms = terms
        self._asker = asker
        self._recorder = recorder
        self._begins = begins
        self._unwritten: list[_Flown] = []
        scheme = machine.scheme
        self._ahead_ticks = 0
        """how far ahead of a tick the set-points are taken that are sent at it"""
        self._starts = (0.0,) * len(terms.signals.outputs)
        """set-points of outputs for which the controller has none"""
        self._wanted = self._command
        if isinstance(scheme, MirroredLaw):
            self._ahead_ticks = scheme.queue * terms.ticks_per_sample
            starts = list(self._starts)
            for one in scheme.ranges:
                starts[one.output] = one.start
            self._starts = tuple(starts)
            self._wanted = self._set_points

    @property
    def state(self) -> CodecState:
        return self.two_way_state.codec

    @property
    def first_problem(self) -> str:
        return self._asker.first_problem

    @property
    def standing(self) -> Standing:
        return self.two_way_state

    def go_back(self, standing: Standing) -> None:
        assert isinstance(standing, TwoWayState)
        self.two_way_state = standing

    def restart(self, sample: int) -> None:
        self.write_down()
        self.two_way_state = self.machine.initial(sample)
        if self._begins is not None:
            outputs = self.machine.codec.model.measured(self.state.model)
            self._begins(sample * self._terms.ticks_per_sample, outputs)

    def carry_on(self, sample: int, silent_samples: int) -> None:
        machine, state = self.machine, self.two_way_state
        known = (state.hold,) * machine.lead_ticks
        anew = machine.initial(sample)._replace(commands=known, hold=state.hold)
        paused = sample - state.sample
        if not 0 <= paused <= self._terms.history_samples:
            self.two_way_state = anew
            return
        try:
            for _ in range(paused):
                # Nothing goes down: words of set-points stand still, coded commands are held.
                state = machine.step(state, ERASED, (None,) * machine.commands_in(state)).state
        except (CodecDiverged, ArithmeticError, ValueError):
            self.two_way_state = anew
            return
        coder, codec = machine.codec.coder, state.codec
        if paused + silent_samples > KEEP_CODER_SAMPLES or not is_coder_state(coder, codec.coder):
            state = state._replace(codec=codec._replace(coder=coder.initial()))
        self.two_way_state = state

    def begin(self, epoch: int, *, afresh: bool) -> Start:
        self.write_down()
        state, sample_ns = self.two_way_state, self._terms.sample_ns
        write_epoch(self._recorder, sample_ns, epoch, state.codec, state.hold)
        packed = self.machine.pack(state)
        write_two_way(self._recorder, sample_ns, state.sample, epoch, packed)
        return Start((), b"" if afresh else packed)

    def fly(self, word: Word, session: int, epoch: int, now_ns: int) -> list[Frame]:
        before = self.two_way_state
        try:
            flown, symbols = self.machine.fly(before, word, self._wanted)
        except (ArithmeticError, ValueError) as error:
            raise CodecDiverged(f"the estimate diverged in sample {before.sample}: {error}") from error
        self.two_way_state = flown.state
        self.history.add(epoch, word, flown.state.codec)
        self._unwritten.append(_Flown(before, word, symbols, flown, now_ns))
        if len(self._unwritten) >= UNWRITTEN_MAX:
            self.write_down()
        first = before.sample * len(symbols)
        return [DownSymbol(session, epoch, slot, number) for slot, number in enumerate(symbols, first)]

    def write_down(self) -> None:
        unwritten, self._unwritten = self._unwritten, []
        recorder, terms, machine = self._recorder, self._terms, self.machine
        for before, word, symbols, one, now_ns in unwritten:
            ranges = machine.codec.coder.ranges(before.codec.coder)
            digest = machine.digest(one.state)
            write_sample(recorder, terms, word, ranges, one.state.codec, digest, now_ns)
            write_down_symbols(recorder, terms.sample_ns, before.sample, symbols)
            flown = FlownSample(one.state.codec, one.coded, one.live, one.commands)
            write_commands(recorder, terms, before.sample, flown, self._asker.references)

    def _command(self, tick: int, live: Vector) -> Vector:
        return self._asker.command(tick, live, self.two_way_state.hold)

    def _set_points(self, tick: int, live: Vector) -> Vector:
        wanted = self._asker.references(tick + self._ahead_ticks)
        pairs = zip(wanted, self._starts, strict=True)
        return tuple([start if one is None else float(one) for one, start in pairs])
