"""The controller node without time and transport: messages and times in, messages out.

`ReceiverEndpoint` is for a real clock, `SteppedEndpoint` for the virtual one of a transmitter in
another process. A loop (`receiver.loops`) asks either when it is due, gives it what came, and sends
what it returns. A flight within one process steps the endpoint directly.
"""

from __future__ import annotations

from channel.errors import ConfigMismatch, FrameError, LinkLost
from channel.line.clocks import SkewedClock
from channel.line.line import Downlink, Inlet, bits_per_symbol
from channel.line.slots import Departure
from channel.line.virtual import Reply, decode_step, encode_reply, is_envelope
from channel.links.serial.slot_finder import SlotFinder
from channel.protocol.endings import End
from channel.protocol.frames import Frame, Hello, ShortSymbol
from receiver.session.session import Phase, ReceiverSession

REFUSAL_LINGER_S = 1.0
"""How long a refused transmitter has to say in which fields it differs."""


class ReceiverEndpoint:
    """A session with its way in and its way out. Times are of one monotonic clock.

    `clock` is this end's clock, if it is a bad one on purpose.
    """

    def __init__(
        self,
        session: ReceiverSession,
        downlink: Downlink | None = None,
        clock: SkewedClock | None = None,
    ) -> None:
        self.session = session
        self.downlink = downlink or Downlink()
        alphabet = session.codec.coder.alphabet
        self.inlet = Inlet(
            self.downlink.wire, session.on_malformed, bits_per_symbol=bits_per_symbol(alphabet)
        )
        self._slots = SlotFinder(session.terms.up_grid)
        """of the symbol bytes of a serial line"""
        self._clock = clock
        self._heard_ns: int | None = None

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return when there is something to do without a message; None: nothing is planned."""
        due_ns = self.session.next_deadline()
        if due_ns is not None and self._clock is not None:
            due_ns = self._clock.reached(due_ns, now_ns)
        sending_ns = self.downlink.next_due_ns
        if due_ns is None or sending_ns is None:
            return sending_ns if due_ns is None else due_ns
        return min(due_ns, sending_ns)

    def take(self, data: bytes | None, now_ns: int) -> list[bytes]:
        """Take a message, or none, and let time pass to `now_ns`; return what is to be sent now.

        Raises ConfigMismatch when the peer flies on the virtual clock.
        """
        shown_ns = now_ns if self._clock is None else self._clock.shown(now_ns)
        frames: list[Frame] = []
        if data is not None:
            self._heard_ns = now_ns
            if is_envelope(data):
                raise ConfigMismatch(
                    "the transmitter flies on the virtual clock, this end on the real one; give "
                    "both the same --clock"
                )
            frames += self._on_message(data, shown_ns)
        frames += self.session.on_deadline(shown_ns)
        return self.downlink.offer(frames, now_ns, lambda: self.session.flight_ns(shown_ns))

    def over(self, now_ns: int, peer_timeout_s: float) -> bool:
        """Return whether the flight is over; LinkLost when nothing came for too long."""
        if self._heard_ns is None:
            self._heard_ns = now_ns
        quiet_s = (now_ns - self._heard_ns) / 1e9
        if self.session.phase is Phase.ENDED:
            return True
        if self.session.refusal is not None and quiet_s > REFUSAL_LINGER_S:
            return True
        if quiet_s > peer_timeout_s:
            raise LinkLost(
                f"nothing came from a transmitter for {peer_timeout_s:g} s; is it running, with "
                "the same session name and the other end of this endpoint?"
            )
        return False

    def bye(self, end: End) -> list[bytes]:
        """End the session; return the messages that tell the peer."""
        return [self.downlink.encoded(frame) for frame in self.session.bye(end)]

    def step(self, time_ns: int, data: bytes | None) -> Reply:
        """Do one step of the virtual clock within this process (`channel.line.virtual.Peer`).

        A symbol that arrives exactly at its deadline is in time, so it is taken first.
        """
        frames = [] if data is None else self._on_message(data, time_ns)
        frames += self.session.on_deadline(time_ns)
        return self._reply(frames, time_ns)

    def _reply(self, frames: list[Frame], time_ns: int) -> Reply:
        flight_ns = self.session.flight_ns(time_ns)
        now, later = [], []
        for leaves_ns, message in self.downlink.departures(frames, flight_ns):
            if leaves_ns == flight_ns:
                now.append(message)
            else:
                later.append(Departure(time_ns + leaves_ns - flight_ns, message))
        return Reply(0, self.session.next_deadline(), tuple(now), tuple(later))

    def _on_message(self, data: bytes, now_ns: int) -> list[Frame]:
        session = self.session
        frame = self.inlet.take(data)
        if frame is None:
            return []
        if isinstance(frame, ShortSymbol) and session.due_slot is not None:
            frame = self._slots.find(frame, session.due_slot, now_ns)
        answers = session.on_frame(frame, now_ns)
        if isinstance(frame, Hello):
            wire, terms = self.inlet.wire, session.terms
            size = sum([wire.size(wire.encode(answer)) for answer in answers])
            self._slots.answered(frame, answers, now_ns + size * terms.downlink_byte_ns)
        return answers


class SteppedEndpoint(ReceiverEndpoint):
    """The same on the virtual clock: steps in, replies out. The transmitter's process has the time."""

    _last_number = -1
    _last_reply = b""

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return None: time passes by steps alone."""
        return None

    def take(self, data: bytes | None, now_ns: int) -> list[bytes]:
        """Take one step, or none; return its reply. A repeated step gets the same one.

        Raises ConfigMismatch when the peer flies on the real clock.
        """
        if data is None:
            return []
        self._heard_ns = now_ns
        if not is_envelope(data):
            # A serial line that lost bytes may show what looks like a symbol: only a request counts.
            if isinstance(self.inlet.take(data), Hello):
                raise ConfigMismatch(
                    "the transmitter flies on the real clock, this end on the virtual one; give both "
                    "the same --clock"
                )
            return []
        try:
            step = decode_step(data)
        except FrameError as error:
            self.session.on_malformed(str(error))
            return []
        if step.number != self._last_number:
            reply = self.step(step.time_ns, step.data)
            self._last_number = step.number
            self._last_reply = encode_reply(reply._replace(number=step.number))
        return [self._last_reply]

    def bye(self, end: End) -> list[bytes]:
        """End the session; there is nothing to send, since the peer waits for replies alone."""
        super().bye(end)
        return []
