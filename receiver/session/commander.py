"""From words to what goes down for them: what every commander does, and the commander with echoes.

The session decides which word was received; a commander applies it. Each word advances its state by
one sample and settles the commands of the sample's ticks `D` ahead. It knows no slot and no peer.
`EchoCommander` sends exact commands and echoes, `receiver.session.narrow` down symbols.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWayState
from channel.codec.lead import FlownSample, Fly, fly_sample
from channel.errors import CodecDiverged
from channel.protocol.compact import compact_form
from channel.protocol.frames import Commands, Echo, Frame
from channel.protocol.limits import from_steps, to_steps
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder, write_down_symbols, write_epoch
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.records import write_commands, write_sample
from receiver.session.rejoin import carried_to

Begins = Callable[[int, Vector], None]
"""Is called where the flight begins afresh, with the tick and the outputs estimated there."""
UNWRITTEN_MAX = 32
"""Samples that may be flown before they are recorded even if nobody finds the time."""


class EchoStanding(NamedTuple):
    """The state of a flight that determines the next epoch."""

    state: CodecState
    hold: Vector
    commands: tuple[Vector, ...]


Standing: TypeAlias = EchoStanding | TwoWayState


class Start(NamedTuple):
    """What a welcome says of the state that an epoch starts from."""

    hold_steps: tuple[int, ...]
    state: bytes


class Flown(NamedTuple):
    """One sample, and what goes down for it."""

    sample: FlownSample
    frames: list[Frame]
    digest: Callable[[], int]
    """of the state after it; asked for when it is recorded"""
    down_symbols: Sequence[int] | None = None


class _Unwritten(NamedTuple):
    before: CodecState
    word: Word
    flown: Flown
    now_ns: int


CANNOT_ADVANCE = (ArithmeticError, ValueError)
"""The exceptions of an estimate that cannot be advanced."""


def diverged(sample: int, error: Exception) -> CodecDiverged:
    """Return the exception to raise for an estimate that could not be advanced in this sample."""
    return CodecDiverged(f"the estimate diverged in sample {sample}: {error}")


class Commander(ABC):
    """Flies samples; see the module's text."""

    def __init__(
        self, codec: Codec, terms: Terms, asker: Asker, recorder: Recorder, begins: Begins | None
    ) -> None:
        self.codec = codec
        self.terms = terms
        self.history = History(codec, 2 * terms.history_samples)
        self._asker = asker
        self._recorder = recorder
        self._begins = begins
        self._unwritten: list[_Unwritten] = []

    @property
    @abstractmethod
    def state(self) -> CodecState:
        """Return the codec's state before the next sample."""

    @property
    @abstractmethod
    def standing(self) -> Standing:
        """Return where the flight stands, to be gone back to."""

    @abstractmethod
    def go_back(self, standing: Standing) -> None:
        """Stand where the flight stood before."""

    @abstractmethod
    def carry_on(self, sample: int, silent_samples: int) -> None:
        """Begin an epoch at a later sample, the state carried there; the last samples had no symbol."""

    @abstractmethod
    def _begin_afresh(self, sample: int) -> None:
        """Stand at a sample with the initial state and command."""

    @abstractmethod
    def _start(self, epoch: int) -> Start:
        """Record the state that an epoch starts from; return what the other end has to know of it."""

    @abstractmethod
    def _fly(self, word: Word, session: int, epoch: int) -> Flown:
        """Consume the word of the next sample; CodecDiverged where it cannot."""

    @property
    def first_problem(self) -> str:
        """Return what was wrong with the controller's first bad command; empty without one."""
        return self._asker.first_problem

    def restart(self, sample: int) -> None:
        """Begin afresh at a sample, from the initial state and command."""
        self.write_down()
        self._begin_afresh(sample)
        if self._begins is not None:
            outputs = self.codec.model.measured(self.state.model)
            self._begins(sample * self.terms.ticks_per_sample, outputs)

    def begin(self, epoch: int, *, afresh: bool) -> Start:
        """Record the start of an epoch; return what the other end is to start from."""
        self.write_down()
        start = self._start(epoch)
        return start._replace(state=b"") if afresh else start

    def fly(self, word: Word, session: int, epoch: int, now_ns: int) -> list[Frame]:
        """Consume the word of the next sample; return the frames to send for it."""
        before = self.state
        flown = self._fly(word, session, epoch)
        self.history.add(epoch, word, self.state)
        self._unwritten.append(_Unwritten(before, word, flown, now_ns))
        if len(self._unwritten) >= UNWRITTEN_MAX:
            self.write_down()
        return flown.frames

    def write_down(self) -> None:
        """Record the samples since the last call. It can wait until the frames were sent."""
        unwritten, self._unwritten = self._unwritten, []
        recorder, terms = self._recorder, self.terms
        for before, word, flown, now_ns in unwritten:
            ranges = self.codec.coder.ranges(before.coder)
            write_sample(recorder, terms, word, ranges, flown.sample.state, flown.digest(), now_ns)
            if flown.down_symbols is not None:
                write_down_symbols(recorder, terms.sample_ns, before.sample, flown.down_symbols)
            write_commands(recorder, terms, before.sample, flown.sample, self._asker.references)


class EchoCommander(Commander):
    """Sends exact commands, and an echo of each word: the full and the compact downlink.

    The controller is asked for the commands of a sample's ticks `D` ahead. What was consumed and
    decided becomes an echo.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        asker: Asker,
        recorder: Recorder,
        begins: Begins | None,
        fly: Fly = fly_sample,
    ) -> None:
        super().__init__(codec, terms, asker, recorder, begins)
        self._fly_sample = fly
        self._state = codec.initial()
        self.hold = terms.initial_command
        """last command decided"""
        self._commands: deque[Vector] = deque([self.hold] * terms.lead_ticks)
        """of the next `D` ticks"""
        self._echoes: deque[Echo] = deque(maxlen=terms.repeats + 1)
        self._steps: list[int] = []
        """decided for the sample that is being flown"""
        self.compact = compact_form(codec, terms)

    @property
    def state(self) -> CodecState:
        return self._state

    @property
    def standing(self) -> Standing:
        return EchoStanding(self._state, self.hold, tuple(self._commands))

    def go_back(self, standing: Standing) -> None:
        assert isinstance(standing, EchoStanding)
        self._state, self.hold, commands = standing
        self._commands = deque(commands)
        self._echoes.clear()

    def carry_on(self, sample: int, silent_samples: int) -> None:
        known, lag_max = tuple(self._commands), self.terms.history_samples
        self._state = carried_to(
            self.codec, self._state, sample, known, self.hold, silent_samples, lag_max
        )
        self._hold(self.hold)

    def _begin_afresh(self, sample: int) -> None:
        self._state = self.codec.initial()._replace(sample=sample)
        self._hold(self.terms.initial_command)

    def _start(self, epoch: int) -> Start:
        write_epoch(self._recorder, self.terms.sample_ns, epoch, self._state, self.hold)
        first = self.hold == self.terms.initial_command
        steps = () if first else to_steps(self.hold, self.terms.signals)
        return Start(steps, self.codec.pack(self._state))

    def _hold(self, command: Vector) -> None:
        self.hold = command
        self._commands = deque([command] * self.terms.lead_ticks)
        self._echoes.clear()

    def _fly(self, word: Word, session: int, epoch: int) -> Flown:
        sample = self._state.sample
        self._steps = []
        try:
            flown = self._flown(word)
        except CANNOT_ADVANCE as error:
            raise diverged(sample, error) from error
        self._commands.extend(flown.commands)
        for _ in range(len(self._commands) - self.terms.lead_ticks):
            self._commands.popleft()
        self._state = flown.state
        digest = self.codec.digest(flown.state)
        number = self.codec.coder.alphabet.word_number(word)
        self._echoes.append(Echo(sample, number, digest, tuple(self._steps)))
        echoes = tuple(self._echoes)
        if self.compact is not None:
            return Flown(flown, [self.compact.packed(session, epoch, echoes)], lambda: digest)
        return Flown(flown, [Commands(session, epoch, echoes)], lambda: digest)

    def _flown(self, word: Word) -> FlownSample:
        """Fly a sample with the commands that the controller decides, or with their mean held."""
        known, held = tuple(self._commands), self.hold
        flown = self._fly_sample(self.codec, self._state, word, known, self._decide)
        if self.compact is None:
            return flown
        # The law's first command, held, would steer half a sample late. The mean moves the plant as the
        # law's own course would, and the law is asked at every tick as ever.
        steps = self.compact.held(flown.commands, held)
        self.hold = from_steps(steps, self.terms.signals)
        self._steps = [*steps] * self.terms.ticks_per_sample
        return self._fly_sample(self.codec, self._state, word, known, lambda _tick, _state: self.hold)

    def _decide(self, tick: int, state: Vector) -> Vector:
        """Ask the controller, limit its command, and return it as sent on the wire."""
        limited = self.terms.limits.apply(self._asker.command(tick, state, self.hold), self.hold)
        steps = to_steps(limited, self.terms.signals)
        self._steps += steps
        self.hold = from_steps(steps, self.terms.signals)
        return self.hold
