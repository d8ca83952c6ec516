"""Following the receiver by its echoes: every command frame says what was consumed and decided."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from channel.codec.codec import ERASED, CodecState, Vector
from channel.protocol.events import ASKED
from channel.protocol.frames import Commands, Echo, Frame, Welcome, Why
from channel.protocol.lockstep import History
from channel.protocol.recording import write_epoch
from transmitter.session.copies import CANNOT_FLY, Confirmed, Copies, EchoOrder, commands_of
from transmitter.session.due import DueCommands
from transmitter.session.following import Lost, Parts
from transmitter.session.records import write_sample
from transmitter.session.rejoin import start_of


class EchoFollowing:
    """A `Following` of the full and the compact downlink.

    `overtaking_ticks`: how long after a command frame one may come that was sent before it.
    """

    def __init__(self, parts: Parts, overtaking_ticks: int) -> None:
        terms = parts.terms
        self._parts = parts
        self.copies = Copies(parts.codec, terms)
        self.history = History(parts.codec, 2 * terms.history_samples)
        self._echoes = EchoOrder(overtaking_ticks, terms.history_samples)
        self._due = DueCommands(terms.initial_command, terms.lead_ticks)
        self._confirmed: deque[Confirmed] = deque(maxlen=2 * terms.history_samples)
        self._compared: CodecState | None = None
        """last state found equal to the receiver's"""
        self._epoch = 0
        self._lag_max = terms.history_samples

    @property
    def confirmed_state(self) -> CodecState:
        return self.copies.confirmed

    @property
    def next_sample(self) -> int:
        return self.copies.next_sample

    @property
    def lag_samples(self) -> int:
        return self.copies.lag_samples

    @property
    def last_command(self) -> Vector:
        return self._due.last

    @property
    def unrecorded(self) -> int:
        return len(self._confirmed)

    def reliable_state(self, tick: int) -> Vector | None:
        """Return the confirmed state, once it has been compared with the receiver's and is equal."""
        state = self.copies.confirmed
        return state.model if self._compared is state else None

    def restart(self, welcome: Welcome, held_ticks: int) -> None:
        codec, terms = self._parts.codec, self._parts.terms
        state, hold = start_of(welcome, codec, terms)
        self._epoch = welcome.epoch
        self.copies.restart(state, hold)
        self._echoes.clear()
        self._due.restart(state.sample * terms.ticks_per_sample, hold, held_ticks)
        write_epoch(self._parts.recorder, terms.sample_ns, welcome.epoch, state, hold)

    def pause(self) -> None:
        """Go on with the commands that are proven; there is nothing to stop."""

    def at_tick(self, tick: int) -> Lost | None:
        terms = self._parts.terms
        sample = tick // terms.ticks_per_sample
        if sample - self.copies.confirmed.sample > self._lag_max:
            return Lost(Why.LAG, replace(ASKED, number=self._lag_max))
        if lost := self._check_gap(tick):
            return lost
        self._parts.counts["words_missed"] += self.copies.skip_to(sample)
        return None

    def encode(self, measurement: Vector) -> tuple[int, ...]:
        word = self._parts.codec.encode(self.copies.state_before_next(), measurement)
        self.copies.sent(word)
        return word

    def command(self, tick: int) -> Vector | None:
        return self._due.take(tick)

    def conclude(self, end_sample: int, *, withheld: bool) -> None:
        self._echoes.end_before(end_sample)
        if not withheld:
            self._parts.counts["words_missed"] += self.copies.skip_to(end_sample)

    def take_confirmed(self) -> list[Confirmed]:
        taken = [self.copies.explained(done) for done in self._confirmed]
        self._confirmed.clear()
        for done in taken:
            write_sample(self._parts.recorder, self._parts.terms, self._parts.codec, done)
        return taken

    def take(self, frame: Frame, tick: int) -> Lost | None:
        counts, expected = self._parts.counts, self.copies.confirmed.sample
        if not isinstance(frame, Commands) or frame.echoes[-1].sample < expected:
            # A copy, or a recording: it brings nothing, and proves nobody alive.
            counts["stale_frames"] += 1
            return None
        sample = max(0, tick) // self._parts.terms.ticks_per_sample
        bounds = self._parts.bounds
        if bounds.drops(bounds.of_commands(frame, sample, expected, self.copies.next_sample)):
            return None
        self._parts.on_heard()
        self._echoes.add(frame.echoes, expected, tick, sample)
        while (echo := self._echoes.take(self.copies.confirmed.sample)) is not None:
            if lost := self._confirm(echo):
                return lost
        return self._check_gap(tick)

    def _check_gap(self, tick: int) -> Lost | None:
        if not self._echoes.is_lost(expected := self.copies.confirmed.sample, tick):
            return None
        return Lost(Why.GAP, replace(ASKED, sample=expected))

    def _confirm(self, echo: Echo) -> Lost | None:
        """Advance the confirmed copy by one echo; return the difference, if there is one."""
        codec, terms, counts = self._parts.codec, self._parts.terms, self._parts.counts
        word = codec.coder.alphabet.word(echo.word_number)
        commands = commands_of(echo, terms)
        try:
            done = self.copies.confirm(word, commands, echo.digest, echo.digest_mask)
        except CANNOT_FLY as error:
            return diverged(self._parts, error)
        self._confirmed.append(done)
        self.history.add(self._epoch, word, done.flown.state)
        checked, erased, unsent = echo.digest_mask > 0, word is ERASED, done.lag_samples == 0
        counts["confirmed"] += 1
        counts["digest_checks"] += checked
        counts["erasures"] += erased
        counts["words_missed"] += unsent
        if done.digest != done.peer_digest:
            return Lost(Why.DESYNC, replace(ASKED, sample=done.sample), done)
        # Only now: a receiver with a different state must move no motor.
        if checked:
            self._compared = done.flown.state
            self._parts.owing.on_confirmed()
        first_tick = echo.sample * terms.ticks_per_sample + terms.lead_ticks
        self._due.add(first_tick, commands, proven=checked)
        return None


def diverged(parts: Parts, error: Exception) -> Lost:
    """Count a state that cannot be continued; the receiver goes on from its own, so this differs."""
    parts.counts["diverged"] += 1
    return Lost(Why.LAG, replace(ASKED, detail=repr(error)))
