"""From words to what goes down for them: an interface.

The session decides which word was received; a commander applies it. Each word advances its state by
one sample and settles the commands of the sample's ticks `D` ahead. It knows no slot and no peer.
`receiver.session.echoes` sends exact commands and echoes, `receiver.session.narrow` down symbols.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeAlias

from channel.codec.codec import CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWayState
from channel.protocol.frames import Frame
from channel.protocol.lockstep import History

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


class Commander(Protocol):
    """Flies samples; see the module's text."""

    history: History

    @property
    def state(self) -> CodecState:
        """Return the codec's state before the next sample."""

    @property
    def first_problem(self) -> str:
        """Return what was wrong with the controller's first bad command; empty without one."""

    @property
    def standing(self) -> Standing:
        """Return where the flight stands, to be gone back to."""

    def go_back(self, standing: Standing) -> None:
        """Stand where the flight stood before."""

    def restart(self, sample: int) -> None:
        """Begin afresh at a sample, from the initial state and command."""

    def carry_on(self, sample: int, silent_samples: int) -> None:
        """Begin an epoch at a later sample, the state carried there; the last samples had no symbol."""

    def begin(self, epoch: int, *, afresh: bool) -> Start:
        """Record the start of an epoch; return what the other end is to start from."""

    def fly(self, word: Word, session: int, epoch: int, now_ns: int) -> list[Frame]:
        """Consume the word of the next sample; return the frames to send for it."""

    def write_down(self) -> None:
        """Record the samples since the last call. It can wait until the frames were sent."""
