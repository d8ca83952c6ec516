"""From words to what goes down for them: the common part of all commanders.

The session decides which word was received; a commander applies it. Each word advances its state by
one sample and settles the commands of the sample's ticks `D` ahead. It knows no slot and no peer.
`receiver.session.echoes` sends exact commands and echoes, `receiver.session.narrow` down symbols.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWayState
from channel.codec.lead import FlownSample
from channel.errors import CodecDiverged
from channel.protocol.frames import Frame
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder, write_down_symbols
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.records import write_commands, write_sample

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
        """Consume the word of the next sample; ArithmeticError or ValueError where it cannot."""

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
        try:
            flown = self._fly(word, session, epoch)
        except (ArithmeticError, ValueError) as error:
            raise CodecDiverged(f"the estimate diverged in sample {before.sample}: {error}") from error
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
