"""Sessions of the receiver, greeted or not, for its tests."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from channel.codec.codec import Codec
from channel.codec.coders.zoom import ZoomCoder
from channel.protocol.events import EventKind
from channel.protocol.frames import (
    Commands,
    Frame,
    Hello,
    Symbol,
)
from receiver.session.session import Phase, ReceiverSession
from tests.channel.codec.parts import ConstantController, identity_of, pitch_codec, terms
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes

MS = 1_000_000
SESSION = 77
PEER = 5
CODEC = pitch_codec()
IDENTITY = identity_of(CODEC)


def hello(incarnation: int = PEER, **changes: Any) -> Hello:
    identity = replace(IDENTITY, **changes)
    return Hello(incarnation, identity.version, identity.config_digest, identity.numerics_probe)


def receiver(
    *volts: float, codec: Codec = CODEC, take_over: bool = False, **changes: Any
) -> ReceiverSession:
    controller = ConstantController(*(volts or (1.0, -1.0)))
    return ReceiverSession(codec, terms(**changes), controller, IDENTITY, SESSION, take_over=take_over)


def flying(*volts: float, **changes: Any) -> ReceiverSession:
    session = receiver(*volts, **changes)
    session.on_frame(hello(), 0)
    assert session.phase is Phase.FLYING
    return session


def two_axes(**changes: Any) -> ReceiverSession:
    """Return a session whose words have two symbols."""
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 10)
    return flying(codec=codec, symbols_per_word=2, rate_baud=20.0, **changes)


def symbol(slot: int, number: int = 1, session: int = SESSION, epoch: int = 0) -> Symbol:
    return Symbol(session, epoch, slot, number)


def word_numbers(frames: list[Frame]) -> list[int]:
    """Return the word of the newest echo of every command frame."""
    return [frame.echoes[-1].word_number for frame in frames if isinstance(frame, Commands)]


def kinds(session: ReceiverSession) -> list[EventKind]:
    return [event.kind for event in session.events]
