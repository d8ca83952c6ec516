"""The messages of the two sessions. Their bytes are in `channel.protocol.wire`.

Uplink: Hello, Symbol, Desync, Bye. Downlink: Welcome, Refuse, Commands, Desync, Unknown, Claim, Bye;
with the narrow downlink DownSymbol in place of Commands.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, TypeAlias

from channel.protocol.endings import Ending


class Why(IntEnum):
    """Why a transmitter asks for a session."""

    START = 0
    """it has none"""
    DESYNC = 1
    """the digests of a sample differed"""
    GAP = 2
    """more consecutive echoes were lost than command frames repeat"""
    LAG = 3
    """no echo came within the history"""
    UNKNOWN = 4
    """the receiver does not know the session: it was restarted, for example"""
    GUARD = 5
    """without commands the watchdog ramped the voltage down"""
    TAKEN_OVER = 6
    """another receiver takes the flight over, on purpose"""
    REST = 7
    """what comes down fits no hypothesis of the receiver's state"""


@dataclass(frozen=True, slots=True)
class Hello:
    """The transmitter is there and asks for a session, or for a new epoch of the one it has.

    It is repeated until it is answered, so an answer names the request that it belongs to.
    """

    incarnation: int
    """drawn anew by every process, 32 bits"""
    version: str
    """of the software, for people; the wire format's own version is in every frame"""
    config_digest: bytes
    """16 bytes, of the shared part of the configuration"""
    numerics_probe: bytes
    """8 bytes, of the codec run over fixed vectors"""
    request: int = 0
    """counts the times that this process asked; repetitions of one request are equal"""
    session: int = 0
    """that the transmitter flew in; 0: none yet"""
    epoch: int = 0
    sample: int = 0
    """first sample that the transmitter can still send, in its own count"""
    why: Why = Why.START


@dataclass(frozen=True, slots=True)
class Welcome:
    """The receiver accepts: symbols may start, with `first_sample`, from a common state."""

    session: int
    """drawn by the receiver, 32 bits; every later frame of both directions carries it"""
    epoch: int
    first_sample: int
    incarnation: int
    """of the Hello that is answered"""
    request: int = 0
    """of the Hello that is answered"""
    hold_steps: tuple[int, ...] = ()
    """command of the first `D` ticks from `first_sample` on; empty: the initial command"""
    state: bytes = b""
    """codec state before `first_sample`, in canonical bytes; empty: the initial one"""


@dataclass(frozen=True, slots=True)
class Refuse:
    """The receiver does not fly with this transmitter."""

    incarnation: int
    ending: Ending
    text: str
    """for people; may be empty"""
    config: str
    """shared part of the receiver's configuration as JSON, so that the other end can name fields"""


@dataclass(frozen=True, slots=True)
class Symbol:
    """One coded symbol in its slot."""

    session: int
    epoch: int
    slot: int
    """counted from the first symbol of sample 0"""
    number: int
    """place of the symbol in the coder's alphabet"""


@dataclass(frozen=True, slots=True)
class DownSymbol:
    """One symbol of the narrow downlink in its slot (`channel.codec.downlink.layout`)."""

    session: int
    epoch: int
    slot: int
    """counted from the first down symbol of sample 0"""
    number: int
    """0 or 1"""


@dataclass(frozen=True, slots=True)
class ShortSymbol:
    """A symbol as a byte of a serial line carries it; the other end sent a Symbol.

    The receiver's endpoint makes a LocatedSymbol of it.
    """

    number: int
    slot_low: int
    """the slot modulo `slot_modulus`"""
    slot_modulus: int


@dataclass(frozen=True, slots=True)
class LocatedSymbol:
    """A symbol whose slot was found by the time at which it came, as the session takes it."""

    number: int
    slot: int | None
    """None: no slot that may come now has it"""
    slot_low: int
    """the slot's digits in its byte"""
    in_time: bool
    anchor: tuple[int, int] | None
    """(slot, time in ns): where deadlines count from now on, if that has changed"""


class Echo(NamedTuple):
    """The word that the receiver consumed for one sample, and the commands that it computed."""

    sample: int
    word_number: int
    """as `Alphabet.word_number` counts; an erasure has a separate number"""
    digest: int
    """of the codec state after the sample, 64 bits"""
    steps: tuple[int, ...]
    """commands of ticks `kN + D ... (k+1)N + D - 1`, all inputs of a tick together"""
    digest_mask: int = 2**64 - 1
    """which bits of the digest came with the echo; the others are zeros"""


@dataclass(frozen=True, slots=True)
class Commands:
    """The echoes of consecutive samples, oldest first; the last one is new."""

    session: int
    epoch: int
    echoes: tuple[Echo, ...]


@dataclass(frozen=True, slots=True)
class ShortCommands:
    """Commands as the compact downlink carries them, packed; `channel.protocol.compact` has the bits.

    Only a session knows the sample, the session and the epoch that they belong to, and whether the
    checksum is right.
    """

    data: bytes
    checksum: int


@dataclass(frozen=True, slots=True)
class Desync:
    """The transmitter's copy differs from the receiver's after this sample.

    The receiver answers with the same frame and its own state, so that both can record both.
    """

    session: int
    epoch: int
    sample: int
    transmitter_digest: int
    receiver_digest: int
    state: bytes
    """the sender's state after the sample, in the codec's canonical bytes; empty: not kept"""


@dataclass(frozen=True, slots=True)
class Unknown:
    """The receiver got a symbol of a session that it does not know: ask for another."""

    session: int
    epoch: int


@dataclass(frozen=True, slots=True)
class Claim:
    """Another receiver takes this flight over, on purpose: ask for a new epoch, of its session."""

    session: int
    """that the transmitter flies in"""
    epoch: int
    by: int
    """session of the receiver that takes over"""


@dataclass(frozen=True, slots=True)
class Bye:
    """The sender ends the session, and says why."""

    session: int
    """0 before there is one, and to a second receiver that is refused"""
    ending: Ending
    text: str = ""
    """for people; may be empty"""


@dataclass(frozen=True, slots=True)
class ForeignVersion:
    """A whole frame of another wire version: not decoded further, but reported."""

    version: int


Frame: TypeAlias = (
    Hello
    | Welcome
    | Refuse
    | Symbol
    | DownSymbol
    | ShortSymbol
    | LocatedSymbol
    | Commands
    | ShortCommands
    | Desync
    | Unknown
    | Claim
    | Bye
    | ForeignVersion
)
