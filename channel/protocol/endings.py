"""How a session ends or is refused. The number is sent, and programs read it.

Beside it goes a text for people, which nothing reads: what the end that speaks knows beyond the number.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Ending(IntEnum):
    """Why an end says goodbye, or refuses. A number of a later version is kept as `UNKNOWN_number`."""

    OVER = 1
    """the flight went to its end"""
    STOPPED = 2
    """a person or a signal stopped this end"""
    FAILED = 3
    """this end's process failed"""
    LINK_LOST = 4
    """this end hears nothing any more, or found no common state again"""
    DESYNC = 5
    """the two copies of the codec differ"""
    SAFETY_STOP = 6
    """the guard took the motors to their safe voltage"""
    WIRE_VERSION = 7
    """the other end's frames are of another wire version"""
    MISMATCH = 8
    """software, configuration or arithmetic of the two ends differ"""
    BUSY = 9
    """the receiver flies with another transmitter"""
    FULL = 10
    """the receiver serves as many rigs as it may"""
    CANNOT_SERVE = 11
    """the receiver has no configuration or no parts for this session"""
    ALREADY_ENDED = 12
    """the receiver's session has ended"""
    SECOND_RECEIVER = 13
    """the transmitter flies with another receiver and stays with it"""
    TAKEN_OVER = 14
    """another receiver has taken the flight over"""
    REJOINS = 15
    """as many rejoins as a session can count"""

    @classmethod
    def _missing_(cls, value: object) -> Ending | None:
        if not isinstance(value, int) or not 0 <= value <= 0xFF:
            return None
        unknown = int.__new__(cls, value)
        unknown._name_ = f"UNKNOWN_{value}"
        unknown._value_ = value
        return unknown


@dataclass(frozen=True, slots=True)
class End:
    """How a session ended, or why it was refused."""

    ending: Ending
    text: str = ""
    """for people; may be empty"""
    by_peer: bool = False
    """whether the other end said so"""
    answer: str = ""
    """the other end's text about a refusal, for people"""
