"""Following the receiver by down symbols: hypotheses of its state, confirmed in time.

A command follows from the hypotheses at every tick, so that commands are never missing. What may be
missing is certainty: with the line cut no sample is confirmed any more. There is no command before the
first down symbol of a flight, after `SILENT_SLOTS` slots in a row without one, and while the newest
confirmed sample is older than `AGE_FACTOR` times the usual confirmation takes. The guard then counts as
it does when commands stay away.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from statistics import median
from typing import NamedTuple

from channel.codec.codec import ERASED, CodecState, Vector
from channel.codec.downlink.machine import TwoWay
from channel.codec.lead import FlownSample
from channel.protocol.events import ASKED
from channel.protocol.frames import DownSymbol, Frame, Welcome, Why
from channel.protocol.lockstep import History
from channel.protocol.recording import write_down_symbols, write_epoch, write_two_way
from transmitter.session.copies import CANNOT_FLY, Confirmed
from transmitter.session.echoes import diverged
from transmitter.session.following import Lost, Parts
from transmitter.session.narrow import hypotheses as narrow
from transmitter.session.narrow.certainty import Certainty
from transmitter.session.narrow.slots import Came, DownSlots, Symbols
from transmitter.session.records import (
    ASSUMED_CHANNEL,
    CONFIRMED_CHANNEL,
    HYPOTHESES_CHANNEL,
    write_sample,
)

SILENT_SLOTS = 12
AGE_FACTOR = 4
AGE_LEAST_SAMPLES = 16
AGE_UNKNOWN_SYMBOLS = 128
"""Age in down symbols, before `DELAYS_KNOWN` samples have said how long a confirmation takes."""
DELAYS_KNOWN = 20
DELAYS_KEPT = 101
CONFIRMED_KEPT = 1024


class _Done(NamedTuple):
    done: narrow.Confirmed
    live: list[Vector | None]


class NarrowFollowing:
    """A `Following` of the narrow downlink.

    `line_delay_ns`: by how much the two lines may delay messages beyond what is agreed.
    """

    def __init__(self, parts: Parts, machine: TwoWay, line_delay_ns: int) -> None:
        self.machine = machine
        self.hypotheses = narrow.Hypotheses(machine)
        self.certainty = Certainty()
        self.history = History(parts.codec, 2 * parts.terms.history_samples)
        self._parts = parts
        self._slots = DownSlots(parts.terms, line_delay_ns)
        self._confirmed: deque[_Done] = deque(maxlen=CONFIRMED_KEPT)
        self._delays: deque[int] = deque(maxlen=DELAYS_KEPT)
        """samples that passed until each of the last ones was confirmed"""
        self._age_max = -(-AGE_UNKNOWN_SYMBOLS // parts.terms.down_symbols)
        terms = parts.terms
        slots_ns = SILENT_SLOTS * terms.sample_ns // terms.down_symbols
        silent_ns = slots_ns + terms.heard_ns + line_delay_ns
        self._silent_ticks_max = -(-silent_ns // terms.tick_ns)
        self._came_tick: int | None = None
        """of the last down symbol, or of the epoch's beginning; None: none has come in this flight"""
        self._live: deque[Vector | None] = deque()
        self._last = parts.terms.initial_command
        self._epoch = self._epoch_tick = 0
        self._steers = False
        """whether commands may be given out"""

    @property
    def confirmed_state(self) -> CodecState:
        return self.hypotheses.confirmed_state.codec

    @property
    def next_sample(self) -> int:
        return self.hypotheses.next_sample

    @property
    def lag_samples(self) -> int:
        return self.hypotheses.next_sample - self.hypotheses.next_heard

    @property
    def last_command(self) -> Vector:
        return self._last

    @property
    def unrecorded(self) -> int:
        return len(self._confirmed)

    def reliable_state(self, tick: int) -> Vector | None:
        """Return the likeliest state, while it is certain what it rests on."""
        return self.hypotheses.state_before_next().model if self._is_certain(tick) else None

    def restart(self, welcome: Welcome, held_ticks: int) -> None:
        machine, terms, recorder = self.machine, self._parts.terms, self._parts.recorder
        sample = welcome.first_sample
        state = machine.unpack(welcome.state) if welcome.state else machine.initial(sample)
        self.hypotheses.restart(state)
        self._slots.restart(sample)
        self._live = deque([None] * terms.lead_ticks)
        self._epoch, self._epoch_tick = welcome.epoch, sample * terms.ticks_per_sample
        if self._came_tick is not None:
            self._came_tick = self._epoch_tick
        # After epochs in a row without a confirmation there is no command before the first one.
        self._steers = not self._parts.owing.counts_on
        write_epoch(recorder, terms.sample_ns, welcome.epoch, state.codec, state.hold)
        write_two_way(recorder, terms.sample_ns, sample, welcome.epoch, machine.pack(state))

    def pause(self) -> None:
        self._steers = False

    def at_tick(self, tick: int) -> Lost | None:
        terms = self._parts.terms
        sample, lag_max = tick // terms.ticks_per_sample, terms.history_samples
        if sample - self.hypotheses.next_heard > lag_max:
            return Lost(Why.LAG, replace(ASKED, number=lag_max, value=self.hypotheses.rest))
        self._skip_to(sample)
        return self._hear(tick)

    def encode(self, measurement: Vector) -> tuple[int, ...]:
        word = self.hypotheses.encode(measurement)
        self.hypotheses.sent(word)
        return word

    def command(self, tick: int) -> Vector | None:
        if not self._steers or tick < self._epoch_tick or not self._is_live(tick):
            return None
        self._last = self.hypotheses.command(tick)
        return self._last

    def conclude(self, end_sample: int, *, withheld: bool) -> None:
        if not withheld:
            self._skip_to(end_sample)

    def take(self, frame: Frame, tick: int) -> Lost | None:
        counts, bounds = self._parts.counts, self._parts.bounds
        if not isinstance(frame, DownSymbol):
            counts["stale_frames"] += 1
            return None
        sample = max(0, tick) // self._parts.terms.ticks_per_sample
        if bounds.drops(bounds.of_down_symbol(frame, sample)):
            return None
        came = self._slots.put(frame.slot, frame.number, tick)
        if came is Came.AGAIN:
            counts["stale_frames"] += 1
            return None
        counts["down_came"] += 1
        if came is Came.LATE:
            counts["down_late"] += 1
            return None
        self._came_tick = tick
        self._parts.on_heard()
        return self._hear(tick)

    def take_confirmed(self) -> list[Confirmed]:
        taken = []
        recorder, terms = self._parts.recorder, self._parts.terms
        for done, live in self._confirmed:
            one = self._as_confirmed(done, live)
            write_sample(recorder, terms, self._parts.codec, one)
            known = (*done.before.commands, *done.flown.commands)[: terms.ticks_per_sample]
            commands = [value for command in known for value in command]
            row = (done.sample, done.word, done.symbols, commands, done.doubt, done.lag_samples)
            recorder.write(CONFIRMED_CHANNEL, done.sample * terms.sample_ns, row)
            taken.append(one)
        self._confirmed.clear()
        return taken

    def _is_live(self, tick: int) -> bool:
        """Return whether symbols come, and samples are confirmed."""
        if self._came_tick is None or tick - self._came_tick > self._silent_ticks_max:
            return False
        return self._is_certain(tick)

    def _is_certain(self, tick: int) -> bool:
        sample = tick // self._parts.terms.ticks_per_sample
        return sample - self.hypotheses.next_confirmed <= self._age_max

    def _skip_to(self, sample: int) -> None:
        while self.hypotheses.next_sample < sample:
            self._parts.counts["words_missed"] += 1
            self.hypotheses.sent(ERASED)

    def _hear(self, tick: int) -> Lost | None:
        """Hear the samples whose symbols have come or are given up, as far as words were sent."""
        while self.hypotheses.next_heard < self.hypotheses.next_sample:
            symbols = self._slots.take(tick)
            if symbols is None:
                return None
            if lost := self._heard(symbols, tick):
                return lost
        return None

    def _heard(self, symbols: Symbols, tick: int) -> Lost | None:
        parts, listed = self._parts, self.hypotheses
        sample = listed.next_heard
        write_down_symbols(parts.recorder, parts.terms.sample_ns, sample, symbols)
        parts.counts["down_erased"] += symbols.count(None)
        try:
            confirmed = listed.heard(sample, symbols)
        except CANNOT_FLY as error:
            return diverged(parts, error)
        for done in confirmed:
            self._confirm(done, tick)
        row = (sample, listed.size, listed.rest, listed.best, listed.next_confirmed)
        parts.recorder.write(HYPOTHESES_CHANNEL, sample * parts.terms.sample_ns, row)
        self.certainty.on_heard(listed.size)
        if listed.rejoin is None:
            return None
        if listed.rejoin.why is Why.REST:
            self._write_assumed()
        return Lost(*listed.rejoin)

    def _write_assumed(self) -> None:
        """Record the samples that are not certain: the first one that differs may be among them."""
        recorder, sample_ns = self._parts.recorder, self._parts.terms.sample_ns
        for node in self.hypotheses.likeliest():
            codec = node.state.codec
            row = (node.sample, self._epoch, node.word, node.symbols, codec.model, codec.coder)
            recorder.write(ASSUMED_CHANNEL, node.sample * sample_ns, row)

    def _confirm(self, done: narrow.Confirmed, tick: int) -> None:
        parts, terms = self._parts, self._parts.terms
        self._live.extend(done.flown.live)
        live = [self._live.popleft() for _ in range(terms.ticks_per_sample)]
        self._confirmed.append(_Done(done, live))
        self.history.add(self._epoch, done.word, done.flown.state.codec)
        hashes = done.heard[self.machine.commands_in(done.before) :]
        parts.counts["confirmed"] += 1
        parts.counts["erasures"] += done.word is ERASED
        parts.counts["hash_symbols"] += len(hashes) - hashes.count(None)
        parts.owing.on_confirmed()
        self._steers = True
        delay = tick // terms.ticks_per_sample - done.sample
        self.certainty.on_confirmed(delay)
        self._delays.append(delay)
        if len(self._delays) >= DELAYS_KNOWN:
            self._age_max = max(AGE_LEAST_SAMPLES, round(AGE_FACTOR * median(self._delays)))

    def _as_confirmed(self, done: narrow.Confirmed, live: list[Vector | None]) -> Confirmed:
        """Return a confirmed sample as it is recorded and scored."""
        codec, after = self._parts.codec, done.flown.state
        flown = FlownSample(after.codec, done.flown.coded, done.flown.live, done.flown.commands)
        digest = self.machine.digest(after)
        before = done.before
        return Confirmed(
            done.sample,
            before.codec,
            done.word_sent,
            done.word,
            flown,
            live,
            digest,
            digest,
            0,
            done.lag_samples,
            codec.about(before.codec, done.word, flown.coded[0]),
        )
