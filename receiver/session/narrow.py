"""The commander of the narrow downlink: down symbols of the two-way state machine, and nothing else.

The machine's state X is here, and it is the truth: it follows from the words consumed and the symbols
sent, whatever the transmitter knows of them (`channel.codec.downlink.machine`).
"""

from __future__ import annotations

from channel.codec.codec import ERASED, CodecState, Vector, Word, is_coder_state
from channel.codec.downlink.machine import TwoWay, TwoWayState
from channel.codec.downlink.mirrored import MirroredLaw
from channel.codec.lead import FlownSample
from channel.errors import CodecDiverged
from channel.protocol.frames import DownSymbol, Frame
from channel.protocol.recording import Recorder, write_epoch, write_two_way
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.commander import (
    CANNOT_ADVANCE,
    Begins,
    Commander,
    Flown,
    Standing,
    Start,
    diverged,
)
from receiver.session.rejoin import KEEP_CODER_SAMPLES


class NarrowCommander(Commander):
    """Sends down symbols; see the module's text."""

    def __init__(
        self, machine: TwoWay, terms: Terms, asker: Asker, recorder: Recorder, begins: Begins | None
    ) -> None:
        super().__init__(machine.codec, terms, asker, recorder, begins)
        self.machine = machine
        self.two_way_state = machine.initial()
        """X before the next sample"""
        scheme = machine.scheme
        self._ahead_ticks = 0
        """how far ahead of a tick the set-points are taken that are sent at it"""
        self._set_points_held = [0.0] * len(terms.signals.outputs)
        """the last set-points, for outputs for which the controller has none, or failed"""
        self._wanted = self._command
        if isinstance(scheme, MirroredLaw):
            self._ahead_ticks = scheme.queue * terms.ticks_per_sample
            for one in scheme.ranges:
                self._set_points_held[one.output] = one.start
            self._wanted = self._set_points

    @property
    def state(self) -> CodecState:
        return self.two_way_state.codec

    @property
    def standing(self) -> Standing:
        return self.two_way_state

    def go_back(self, standing: Standing) -> None:
        assert isinstance(standing, TwoWayState)
        self.two_way_state = standing

    def _begin_afresh(self, sample: int) -> None:
        self.two_way_state = self.machine.initial(sample)

    def carry_on(self, sample: int, silent_samples: int) -> None:
        machine, state = self.machine, self.two_way_state
        known = (state.hold,) * machine.lead_ticks
        anew = machine.initial(sample)._replace(commands=known, hold=state.hold)
        paused = sample - state.sample
        if not 0 <= paused <= self.terms.history_samples:
            self.two_way_state = anew
            return
        try:
            for _ in range(paused):
                # Nothing goes down: words of set-points stand still, coded commands are held.
                state = machine.step(state, ERASED, (None,) * machine.commands_in(state)).state
        except (CodecDiverged, ArithmeticError, ValueError):
            self.two_way_state = anew
            return
        coder, codec = self.codec.coder, state.codec
        if paused + silent_samples > KEEP_CODER_SAMPLES or not is_coder_state(coder, codec.coder):
            state = state._replace(codec=codec._replace(coder=coder.initial()))
        self.two_way_state = state

    def _start(self, epoch: int) -> Start:
        state, sample_ns = self.two_way_state, self.terms.sample_ns
        write_epoch(self._recorder, sample_ns, epoch, state.codec, state.hold)
        packed = self.machine.pack(state)
        write_two_way(self._recorder, sample_ns, state.sample, epoch, packed)
        return Start((), packed)

    def _fly(self, word: Word, session: int, epoch: int) -> Flown:
        before = self.two_way_state
        try:
            one, symbols = self.machine.fly(before, word, self._wanted)
        except CANNOT_ADVANCE as error:
            raise diverged(before.sample, error) from error
        after = self.two_way_state = one.state
        slots = enumerate(symbols, before.sample * len(symbols))
        frames: list[Frame] = [DownSymbol(session, epoch, *numbered) for numbered in slots]
        flown = FlownSample(after.codec, one.coded, one.live, one.commands)
        return Flown(flown, frames, lambda: self.machine.digest(after), symbols)

    def _command(self, tick: int, live: Vector) -> Vector:
        return self._asker.command(tick, live, self.two_way_state.hold)

    def _set_points(self, tick: int, live: Vector) -> Vector:
        wanted = self._asker.references(tick + self._ahead_ticks)
        for output, one in enumerate(wanted):
            if one is not None:
                self._set_points_held[output] = one
        return tuple(self._set_points_held)
