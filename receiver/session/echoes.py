"""The commander of the full and the compact downlink: exact commands, and an echo of each word.

Each word advances the codec by one sample, the controller is asked for the commands of the sample's
ticks `D` ahead, and what was consumed and decided becomes an echo.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.lead import FlownSample, fly_sample
from channel.errors import CodecDiverged
from channel.protocol.compact import compact_form
from channel.protocol.frames import Commands, Echo, Frame
from channel.protocol.limits import from_steps, to_steps
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder, write_epoch
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.commander import UNWRITTEN_MAX, Begins, EchoStanding, Standing, Start
from receiver.session.records import write_commands, write_sample
from receiver.session.rejoin import carried_to


class _Flown(NamedTuple):
    before: CodecState
    word: Word
    flown: FlownSample
    digest: int
    now_ns: int


class EchoCommander:
    """A `Commander`; see the module's text."""

    def __init__(
        self, codec: Codec, terms: Terms, asker: Asker, recorder: Recorder, begins: Begins | None
    ) -> None:
        self._begins = begins
        self.codec = codec
        self.terms = terms
        self.state = codec.initial()
        self.history = History(codec, 2 * terms.history_samples)
        self.hold = terms.initial_command
        """last command decided"""
        self._asker = asker
        self._recorder = recorder
        self._commands: deque[Vector] = deque([self.hold] * terms.lead_ticks)
        """of the next `D` ticks"""
        self._echoes: deque[Echo] = deque(maxlen=terms.repeats + 1)
        self._steps: list[int] = []
        """decided for the sample that is being flown"""
        self.compact = compact_form(codec, terms)
        self._unwritten: list[_Flown] = []

    @property
    def first_problem(self) -> str:
        return self._asker.first_problem

    @property
    def standing(self) -> Standing:
        return EchoStanding(self.state, self.hold, tuple(self._commands))

    def go_back(self, standing: Standing) -> None:
        assert isinstance(standing, EchoStanding)
        self.state, self.hold, commands = standing
        self._commands = deque(commands)
        self._echoes.clear()

    def restart(self, sample: int) -> None:
        self.write_down()
        self.state = self.codec.initial()._replace(sample=sample)
        self._hold(self.terms.initial_command)
        if self._begins is not None:
            outputs = self.codec.model.measured(self.state.model)
            self._begins(sample * self.terms.ticks_per_sample, outputs)

    def carry_on(self, sample: int, silent_samples: int) -> None:
        known = tuple(self._commands)
        self.state = carried_to(
            self.codec, self.state, sample, known, self.hold, silent_samples, self.terms.history_samples
        )
        self._hold(self.hold)

    def begin(self, epoch: int, *, afresh: bool) -> Start:
        self.write_down()
        write_epoch(self._recorder, self.terms.sample_ns, epoch, self.state, self.hold)
        first = self.hold == self.terms.initial_command
        steps = () if first else to_steps(self.hold, self.terms.signals)
        return Start(steps, b"" if afresh else self.codec.pack(self.state))

    def _hold(self, command: Vector) -> None:
        self.hold = command
        self._commands = deque([command] * self.terms.lead_ticks)
        self._echoes.clear()

    def fly(self, word: Word, session: int, epoch: int, now_ns: int) -> list[Frame]:
        before = self.state
        self._steps = []
        try:
            flown = self._flown(word)
        except (ArithmeticError, ValueError) as error:
            raise CodecDiverged(f"the estimate diverged in sample {before.sample}: {error}") from error
        self._commands.extend(flown.commands)
        for _ in range(len(self._commands) - self.terms.lead_ticks):
            self._commands.popleft()
        self.state = flown.state
        self.history.add(epoch, word, self.state)
        digest = self.codec.digest(self.state)
        number = self.codec.coder.alphabet.word_number(word)
        self._echoes.append(Echo(before.sample, number, digest, tuple(self._steps)))
        self._unwritten.append(_Flown(before, word, flown, digest, now_ns))
        if len(self._unwritten) >= UNWRITTEN_MAX:
            self.write_down()
        if self.compact is not None:
            return [self.compact.packed(session, epoch, tuple(self._echoes))]
        return [Commands(session, epoch, tuple(self._echoes))]

    def _flown(self, word: Word) -> FlownSample:
        """Fly a sample with the commands that the controller decides, or with their mean held."""
        known, held = tuple(self._commands), self.hold
        flown = fly_sample(self.codec, self.state, word, known, self._decide)
        if self.compact is None:
            return flown
        # The law's first command, held, would steer half a sample late. The mean moves the plant as the
        # law's own course would, and the law is asked at every tick as ever.
        steps = self.compact.held(flown.commands, held)
        self.hold = from_steps(steps, self.terms.signals)
        self._steps = [*steps] * self.terms.ticks_per_sample
        return fly_sample(self.codec, self.state, word, known, lambda _tick, _state: self.hold)

    def write_down(self) -> None:
        unwritten, self._unwritten = self._unwritten, []
        for before, word, flown, digest, now_ns in unwritten:
            ranges = self.codec.coder.ranges(before.coder)
            write_sample(self._recorder, self.terms, word, ranges, flown.state, digest, now_ns)
            write_commands(self._recorder, self.terms, before.sample, flown, self._asker.references)

    def _decide(self, tick: int, state: Vector) -> Vector:
        """Ask the controller, limit its command, and return it as sent on the wire."""
        limited = self.terms.limits.apply(self._asker.command(tick, state, self.hold), self.hold)
        steps = to_steps(limited, self.terms.signals)
        self._steps += steps
        self.hold = from_steps(steps, self.terms.signals)
        return self.hold
