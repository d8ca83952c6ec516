"""The messages of the two sessions. How they look on a line is `channel.wire`'s affair.

Uplink: Hello, Symbol, Desync, Bye. Downlink: Welcome, Refuse, Commands, Bye.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Hello:
    """The transmitter is there and asks for a session."""

    incarnation: int
    """drawn anew by every process, 32 bits"""
    version: str
    """of the software, for people; the wire format's own version is in every frame"""
    config_digest: bytes
    """16 bytes, of the shared part of the configuration"""
    numerics_probe: bytes
    """8 bytes, of the codec run over fixed vectors"""


@dataclass(frozen=True, slots=True)
class Welcome:
    """The receiver accepts: symbols may start."""

    session: int
    """drawn by the receiver, 32 bits; every later frame of both directions carries it"""
    epoch: int
    first_sample: int
    incarnation: int
    """of the Hello that is answered"""


@dataclass(frozen=True, slots=True)
class Refuse:
    """The receiver does not fly with this transmitter."""

    incarnation: int
    reason: str
    config: str
    """shared part of the receiver's configuration as JSON, so that the other end can name fields"""


@dataclass(frozen=True, slots=True)
class Symbol:
    """One paid symbol in its slot."""

    session: int
    epoch: int
    slot: int
    """counted from the first symbol of sample 0"""
    number: int
    """place of the symbol in the coder's alphabet"""


@dataclass(frozen=True, slots=True)
class ShortSymbol:
    """A symbol as a byte of a serial line carries it: the receiver finds its slot by the time.

    Only ever received; the other end sent a Symbol.
    """

    number: int
    slot_low: int
    """the slot modulo `slot_modulus`"""
    slot_modulus: int


@dataclass(frozen=True, slots=True)
class Echo:
    """What the receiver consumed for one sample, and what it decided on it."""

    sample: int
    word_number: int
    """as `Alphabet.word_number` counts; an erasure has a number of its own"""
    digest: int
    """of the codec state after the sample, 64 bits"""
    millivolts: tuple[int, ...]
    """commands of ticks `kN + D ... (k+1)N + D - 1`, all motors of a tick together"""


@dataclass(frozen=True, slots=True)
class Commands:
    """The echoes of consecutive samples, oldest first; the last one is new."""

    session: int
    epoch: int
    echoes: tuple[Echo, ...]


@dataclass(frozen=True, slots=True)
class Desync:
    """The transmitter's copy differs from the receiver's after this sample."""

    session: int
    epoch: int
    sample: int
    transmitter_digest: int
    receiver_digest: int
    state: bytes
    """the transmitter's state after the sample, in the codec's canonical bytes"""


@dataclass(frozen=True, slots=True)
class Bye:
    """The sender ends the session, and says why."""

    session: int
    """0 before there is one"""
    reason: str


@dataclass(frozen=True, slots=True)
class ForeignVersion:
    """A whole frame of another wire version: not read further, but worth telling about."""

    version: int


Frame: TypeAlias = (
    Hello | Welcome | Refuse | Symbol | ShortSymbol | Commands | Desync | Bye | ForeignVersion
)
