"""Somebody on the line: hears both ways, plays recordings back, forges frames with a good check.

A forged frame is made from what was heard: session, epoch, incarnation, request and sample as they are,
nearly as they are, extreme or random. Two frames are left out, since the protocol allows them to anyone
who knows the session: a farewell in its name, and a refusal of the transmitter's request, end the
flight.
"""

from __future__ import annotations

import random
import struct
from collections import Counter, deque
from collections.abc import Callable

from channel.codec.codec import STATE_MAX, Codec
from channel.errors import FrameError
from channel.protocol import wire
from channel.protocol.endings import Ending
from channel.protocol.frames import (
    Bye,
    Claim,
    Commands,
    Desync,
    Echo,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Unknown,
    Welcome,
    Why,
)
from channel.protocol.identity import Identity
from channel.protocol.terms import Terms

WORLDS_SESSIONS = range(1000, 1100)
"""What `World` numbers its receivers with."""

HEARD_MAX = 400
"""Messages kept to be played back."""

U16, U32, U64 = 0xFFFF, 0xFFFF_FFFF, 0xFFFF_FFFF_FFFF_FFFF
STEPS = (0, 0, 0, 1, 1, 2, 3, 5, 8, 20, 63, 64, 65, 127, 128, 129, 200, 1000)
FLOATS = (0.0, -0.0, 1.0, -1.0, 0.5, 3.0, 1e3, STATE_MAX * 0.999, -STATE_MAX, 1e36, -1e300, 5e-324)
NOT_NUMBERS = (float("nan"), float("inf"), float("-inf"))
TEXTS = ("", "done", "x" * 2500, "\x1b]0;title\x07", "\u2028\u202e", "{" * 500, "[" * 4000)


class Intruder:
    """Makes messages for either end from what it has heard."""

    def __init__(self, chance: random.Random, codec: Codec, terms: Terms, identity: Identity) -> None:
        self.chance = chance
        self.counts: Counter[str] = Counter()
        self._codec = codec
        self._terms = terms
        self._identity = identity
        self._heard: deque[bytes] = deque(maxlen=HEARD_MAX)
        self._session = 1
        self._sessions = {0, 1, *WORLDS_SESSIONS}
        """those whose farewell may end something"""
        self._epoch = 0
        self._incarnation = 1
        self._request = 0
        self._sample = 0
        self._echoed = 0
        """sample whose echo comes next"""
        self._state = codec.initial()
        self._makers: dict[str, Callable[[], Frame]] = {
            "hello": self._hello,
            "welcome": self._welcome,
            "refuse": self._refuse,
            "symbol": self._symbol,
            "commands": self._commands,
            "desync": self._desync,
            "bye": lambda: Bye(self._number(self._session, U32), self._ending(), self._text()),
            "unknown": lambda: Unknown(*self._flight()),
            "claim": lambda: Claim(*self._flight(), self._number(self._session, U32)),
        }

    def hear(self, data: bytes) -> None:
        """Take a message of the flight, of either direction."""
        self._heard.append(data)
        try:
            frame = wire.decode(data)
        except FrameError:
            return
        if isinstance(frame, Welcome | Symbol):
            self._sessions.add(frame.session)
        match frame:
            case Hello():
                self._incarnation, self._request = frame.incarnation, frame.request
            case Welcome():
                self._session, self._epoch = frame.session, frame.epoch
                self._sample = self._echoed = frame.first_sample
                if frame.state:
                    self._state = self._codec.unpack(frame.state)
            case Commands():
                self._echoed = frame.echoes[-1].sample + 1
            case Symbol():
                self._session, self._epoch = frame.session, frame.epoch
                self._sample = frame.slot // self._terms.symbols_per_word

    def replayed(self) -> bytes | None:
        """Return a message that was heard before."""
        self.counts["replayed"] += 1
        return self.chance.choice(self._heard) if self._heard else None

    def forged(self) -> bytes | None:
        """Return a message with a good check; None for one that may end a flight, or fits no frame."""
        kind = self.chance.choice(list(self._makers))
        frame = self._makers[kind]()
        if isinstance(frame, Bye) and frame.session in self._sessions:
            return None
        if isinstance(frame, Refuse) and frame.incarnation == self._incarnation:
            return None
        try:
            data = wire.encode(frame)
        except ValueError:
            return None
        self.counts[f"forged {kind}"] += 1
        return data

    # Fields

    def _number(self, value: int, largest: int) -> int:
        match self.chance.randrange(6):
            case 0 | 1 | 2:
                number = value + self.chance.choice((1, 1, 1, -1)) * self.chance.choice(STEPS)
            case 3:
                number = value
            case 4:
                number = self.chance.choice((0, 1, largest, largest // 2, largest // 2 + 1))
            case _:
                number = self.chance.randrange(largest + 1)
        return max(0, min(largest, number))

    def _flight(self) -> tuple[int, int]:
        """Return session and epoch, mostly those of the flight."""
        if self.chance.random() < 0.8:
            return self._session, self._epoch
        return self._number(self._session, U32), self._number(self._epoch, U16)

    def _text(self) -> str:
        return self.chance.choice(TEXTS)

    def _ending(self) -> Ending:
        return Ending(self.chance.randrange(256))

    def _float(self) -> float:
        if self.chance.random() < 0.2:
            return self.chance.choice(NOT_NUMBERS)
        if self.chance.random() < 0.5:
            return self.chance.choice(FLOATS)
        return self.chance.uniform(-2.0, 2.0) * 10.0 ** self.chance.randrange(-3, 6)

    def _state_bytes(self, sample: int) -> bytes:
        """Return a packed state: of the flight, off in some values, made up, or of another size."""
        size = len(self._state.model) + len(self._state.coder)
        values = list(self._state.model + self._state.coder)
        match self.chance.randrange(6):
            case 0:
                return b""
            case 1:
                return self.chance.randbytes(self.chance.choice((1, 8 * size, 8 + 8 * size, 5000)))
            case 2:
                values = [self._float() for _ in values]
            case _:
                for _ in range(self.chance.randrange(3)):
                    values[self.chance.randrange(size)] = self._float()
        return struct.pack(f"<q{size}d", sample, *values)

    def _steps(self, count: int) -> tuple[int, ...]:
        largest = self.chance.choice((1000, 5000, 5001, 32767))
        return tuple(self.chance.randrange(-largest, largest + 1) for _ in range(count))

    def _count(self, count: int) -> int:
        return count if self.chance.random() < 0.9 else self.chance.randrange(200)

    # Frames

    def _hello(self) -> Hello:
        session, epoch = self._flight()
        own = self._identity
        known = self.chance.random() < 0.9
        return Hello(
            self._number(self._incarnation, U32),
            own.version if known else self._text(),
            own.config_digest if known else self.chance.randbytes(16),
            own.numerics_probe,
            self._number(self._request, U32),
            session,
            epoch,
            self._number(self._sample, U32),
            self.chance.choice(list(Why)),
        )

    def _welcome(self) -> Welcome:
        session, epoch = self._flight()
        # One that is accepted makes a session of this number.
        self._sessions.add(session)
        sample = self._number(self._sample, U32)
        inputs = self._codec.model.input_size
        return Welcome(
            session,
            self._number(epoch, U16),
            sample,
            self._number(self._incarnation, U32),
            self._number(self._request, U32),
            self._steps(self.chance.choice((0, inputs, inputs, inputs, 7, 255))),
            self._state_bytes(sample if self.chance.random() < 0.8 else self._sample),
        )

    def _refuse(self) -> Refuse:
        incarnation = self._number(self._incarnation, U32)
        return Refuse(incarnation, self._ending(), self._text(), self._text())

    def _symbol(self) -> Symbol:
        slot = self._sample * self._terms.symbols_per_word
        number = self.chance.choice((0, 0, 0, 1, 1, 1, 2, 255))
        return Symbol(*self._flight(), self._number(slot, U32), number)

    def _commands(self) -> Commands:
        count = self._count(self.chance.randrange(1, self._terms.repeats + 2)) or 1
        volts = self._count(self._terms.ticks_per_sample * self._codec.model.input_size)
        last = max(count - 1, self._number(self.chance.choice((self._sample, self._echoed)), U32))
        echoes = tuple(
            Echo(
                last + 1 - count + index,
                self.chance.choice((0, 1, 1, U16, U16 - 1, 2)),
                self.chance.choice((0, U64, self.chance.getrandbits(64))),
                self._steps(volts),
            )
            for index in range(count)
        )
        return Commands(*self._flight(), echoes)

    def _desync(self) -> Desync:
        sample = self._number(self._sample, U32)
        digests = (self.chance.getrandbits(64), self.chance.getrandbits(64))
        return Desync(*self._flight(), sample, *digests, self._state_bytes(sample))
