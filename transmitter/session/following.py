"""How a transmitter follows the receiver from one welcome to the next: an interface.

`transmitter.session.echoes` advances a copy of the codec on echoes; `transmitter.session.down_symbols`
keeps hypotheses of the receiver's state. The session has the handshake and the peer. What follows a
welcome says which state is certain, which word comes next, and which command is due.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from channel.codec.codec import Codec, CodecState, Vector
from channel.protocol.bounds import Bounds
from channel.protocol.events import ASKED, Event
from channel.protocol.frames import Frame, Welcome, Why
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder
from channel.protocol.terms import Terms
from transmitter.session.copies import Confirmed
from transmitter.session.owing import Owing


class Lost(NamedTuple):
    """Lockstep is lost: a new epoch must be asked for."""

    why: Why
    details: Event = ASKED
    differing: Confirmed | None = None
    """the sample after which the digests differ"""


@dataclass(frozen=True, slots=True)
class Parts:
    """What the session shares with what follows a welcome."""

    codec: Codec
    terms: Terms
    counts: Counter[str]
    bounds: Bounds
    owing: Owing
    recorder: Recorder
    on_heard: Callable[[], None]
    """is called when the receiver has sent something new in the present epoch"""


class Following(Protocol):
    """From one welcome to the next; see the module's text. Ticks are this end's clock."""

    history: History

    @property
    def confirmed_state(self) -> CodecState:
        """Return the last codec state that is certainly the receiver's."""

    @property
    def next_sample(self) -> int:
        """Return the sample whose word is sent next."""

    @property
    def lag_samples(self) -> int:
        """Return how many samples were sent of which nothing has been heard."""

    @property
    def last_command(self) -> Vector:
        """Return the last command given out."""

    @property
    def unrecorded(self) -> int:
        """Return how many confirmed samples were not taken yet."""

    def reliable_state(self, tick: int) -> Vector | None:
        """Return the model state to check encoders against; None: none can be relied on."""

    def restart(self, welcome: Welcome, held_ticks: int) -> None:
        """Take the common state of a welcome within bounds; its command is held for some ticks."""

    def pause(self) -> None:
        """Note that a new epoch is asked for: nothing of the present one is taken any more."""

    def at_tick(self, tick: int) -> Lost | None:
        """Let time pass to a tick; samples before it whose word was not sent have none."""

    def take(self, frame: Frame, tick: int) -> Lost | None:
        """Take a frame of the present session and epoch."""

    def encode(self, measurement: Vector) -> tuple[int, ...]:
        """Return the word of `next_sample`, which counts as sent; an error of `CANNOT_FLY` if none."""

    def command(self, tick: int) -> Vector | None:
        """Return the command of a tick, None when there is none; earlier ones are forgotten."""

    def conclude(self, end_sample: int, *, withheld: bool) -> None:
        """End before a sample; words that are missing, not `withheld`, were not sent."""

    def take_confirmed(self) -> list[Confirmed]:
        """Record and return the samples confirmed since the last call."""
