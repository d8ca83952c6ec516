"""The course of every symbol and every echo of a flight, and when, before anything is computed.

Loss, delay and erasure do not depend on a symbol's value. So the line is flown once on its own, in
the order of events of the virtual clock (`transmitter.loops.virtual`) and with the receiver's own slot
clock and schedule, over the lines that a flight would use
and with their seeds. What comes out are arrays that a compiled flight reads.
"""

from __future__ import annotations

import heapq
from itertools import count, groupby
from typing import Any, NamedTuple

import numpy as np

from channel.line.line import Delivery
from receiver.session import schedule as receiver
from receiver.session.schedule import SlotClock
from tenbaud.build.ends import build_line
from tenbaud.build.flight import Agreement
from transmitter.loops.virtual import GREETINGS_MAX

IntArray = Any


class Schedule(NamedTuple):
    """Fates of a flight's symbols and echoes; see `flight_data.Given`."""

    shifts: IntArray
    known: IntArray
    late: IntArray
    scored: IntArray
    erasures: int
    """words erased, as far as the transmitter heard of them"""
    commands_late: int
    longest_late: int
    """ticks in a row without their command"""


class Uncommon(Exception):
    """The line does something that only the nodes themselves follow, such as a rejoin."""


def schedule_of(agreement: Agreement, samples: int, ticks: int) -> Schedule:
    """Return the schedule of a flight; Uncommon when it has none."""
    faults = agreement.faults
    if faults.skew_ppm or faults.clock_steps or faults.up.raw or faults.down.raw:
        raise Uncommon("clock errors and inverted bits are flown by the nodes themselves")
    terms = agreement.terms
    if faults.any:
        line = _LineFlight(agreement, samples, ticks)
        line.fly()
        return _arrays(agreement, ticks, line.shifts, line.echo_ns, line.known_first)
    per_word = terms.symbols_per_word
    last_slots = [terms.slot_ns((sample + 1) * per_word - 1) for sample in range(samples)]
    echo_ns = np.array(last_slots, dtype=np.int64) + terms.symbol_delay_ns
    shifts = np.zeros(samples * per_word, dtype=np.int64)
    # What a sample's first symbol brings about comes after the measurement, be it in no time.
    known = np.searchsorted(echo_ns, np.arange(samples) * terms.sample_ns, side="right")
    return _arrays(agreement, ticks, shifts, echo_ns, np.minimum(known, np.arange(samples)))


def _arrays(
    agreement: Agreement, ticks: int, shifts: IntArray, echo_ns: IntArray, known_first: IntArray
) -> Schedule:
    """Turn the times at which echoes come (ns, rising; beyond all time: never) into arrays.

    `known_first`: per sample, echoes that had come before the measurement of its first tick.
    """
    terms = agreement.terms
    tick_ns, per_sample = terms.tick_ns, terms.ticks_per_sample
    at = np.arange(ticks, dtype=np.int64)
    known = np.searchsorted(echo_ns, at * tick_ns, side="right").astype(np.int64)
    known[::per_sample] = known_first
    if np.any(np.arange(len(echo_ns)) - known_first > terms.history_samples):
        raise Uncommon("echoes lag by more than the ends allow")
    scored = echo_ns <= ticks * tick_ns + _linger_ns(agreement)
    erased = (shifts.reshape(-1, terms.symbols_per_word) < 0).any(axis=1)
    frames = np.maximum(at - terms.lead_ticks, 0) // per_sample
    late = ((-(-echo_ns // tick_ns))[frames] > at) & (at >= terms.lead_ticks)
    heard = int(np.count_nonzero(erased & scored))
    longest = max([len(list(run)) for is_late, run in groupby(late) if is_late], default=0)
    missed = int(np.count_nonzero(late))
    return Schedule(shifts, known, late, scored, heard, missed, longest)


def _linger_ns(agreement: Agreement) -> int:
    """Return how long echoes are waited for after the last tick, as a virtual flight does."""
    lines = (build_line(agreement, "up", _WIRE), build_line(agreement, "down", _WIRE))
    return agreement.terms.linger_ns(sum(line.longest_delay_ns for line in lines))


class _NumberWire:
    """Symbols are their numbers: enough for a line to flip one."""

    def is_symbol(self, data: bytes) -> bool:
        return len(data) == 1

    def renumbered(self, data: bytes, shift: int, kinds: int) -> bytes:
        return bytes(((data[0] + shift) % kinds,))


_WIRE = _NumberWire()
_NEVER_NS = 2**62
_LOST = -2
"""the shift of a symbol that is lost: time passes at the receiver, and nothing else"""


class _Arrival(NamedTuple):
    time_ns: int
    order: int
    slot: int
    """of a symbol that goes up; -1: an echo that comes down"""
    sample: int
    shift: int


class _LineFlight:
    """The line's share of one flight."""

    def __init__(self, agreement: Agreement, samples: int, ticks: int) -> None:
        terms = agreement.terms
        self.shifts = np.full(samples * terms.symbols_per_word, -1, dtype=np.int64)
        self.echo_ns = np.full(samples, _NEVER_NS, dtype=np.int64)
        self.known_first = np.zeros(samples, dtype=np.int64)
        self._agreement = agreement
        self._terms = terms
        self._samples = samples
        self._ticks = ticks
        self._up = build_line(agreement, "up", _WIRE)
        self._down = build_line(agreement, "down", _WIRE)
        self._arrivals: list[_Arrival] = []
        self._order = count()
        self._clock = SlotClock(terms)
        self._timing = receiver.Schedule(terms)
        self._timing.begin(0, 0)
        self._expected = 0
        """sample whose echo is due at the transmitter"""

    def fly(self) -> None:
        """Let the whole flight pass."""
        self._greet()
        terms = self._terms
        for sample in range(self._samples):
            now_ns = sample * terms.sample_ns
            self._pass_to(now_ns)
            self.known_first[sample] = min(self._expected, self._samples)
            first = sample * terms.symbols_per_word
            for slot in range(first, first + terms.symbols_per_word):
                leaves_ns = max(terms.slot_ns(slot), now_ns)
                self._push_all(self._symbols(leaves_ns), slot, 0)
            self._pass_to(now_ns)
        self._pass_to((self._ticks - 1) * terms.tick_ns)
        last_ns = self._ticks * terms.tick_ns + _linger_ns(self._agreement)
        self._pass_to(last_ns, deadlines=False)

    def _greet(self) -> None:
        """Draw the chances of the handshake, which goes over the same lines."""
        for _ in range(GREETINGS_MAX):
            pending = [(one.arrival_ns, True) for one in self._up.carry(b"", 0) if one.data is not None]
            met = False
            while pending:
                pending.sort()
                time_ns, upward = pending.pop(0)
                if upward:
                    answers = self._down.carry(b"", time_ns)
                    pending += [(one.arrival_ns, False) for one in answers if one.data is not None]
                else:
                    met = True
            if met:
                return
        raise Uncommon("no handshake gets through this line")

    def _symbols(self, leaves_ns: int) -> list[Delivery]:
        delay_ns = self._terms.symbol_delay_ns
        carried = self._up.carry(b"\0", leaves_ns)
        return [Delivery(arrival_ns + delay_ns, data) for arrival_ns, data in carried]

    def _push_all(self, deliveries: list[Delivery], slot: int, sample: int) -> None:
        for one in deliveries:
            if one.data is None and slot < 0:
                continue
            shift = _LOST if one.data is None else one.data[0] if slot >= 0 else 0
            arrival = _Arrival(one.arrival_ns, next(self._order), slot, sample, shift)
            heapq.heappush(self._arrivals, arrival)

    def _pass_to(self, now_ns: int, deadlines: bool = True) -> None:
        while True:
            arrival_ns = self._arrivals[0].time_ns if self._arrivals else _NEVER_NS
            deadline_ns = (self._clock.deadline_ns if deadlines else None) or _NEVER_NS
            if arrival_ns > now_ns and deadline_ns > now_ns:
                return
            if deadline_ns < arrival_ns:
                self._on_deadline(deadline_ns)
                continue
            arrival = heapq.heappop(self._arrivals)
            if arrival.slot < 0:
                self._on_echo(arrival)
            else:
                if arrival.shift != _LOST:
                    self._on_symbol(arrival)
                self._on_deadline(arrival.time_ns)

    def _on_deadline(self, now_ns: int) -> None:
        for slot in self._clock.expired(now_ns):
            self._settle(slot, -1, now_ns)
            if self._clock.is_silent:
                raise Uncommon("the line is silent for longer than the receiver waits")

    def _on_symbol(self, arrival: _Arrival) -> None:
        clock, timing = self._clock, self._timing
        if arrival.slot < clock.slot:
            near = clock.bridges(arrival.slot)
            if near and timing.is_replaced_by(arrival.slot, arrival.time_ns):
                clock.anchor(timing.take(arrival.slot, arrival.time_ns, anew=True))
            return
        fits = timing.timing(arrival.slot, arrival.time_ns)
        if fits is receiver.Timing.EARLY:
            return
        if not clock.bridges(arrival.slot):
            raise Uncommon("a gap that is longer than the receiver bridges")
        for slot in clock.take(arrival.slot):
            self._settle(slot, -1, arrival.time_ns)
        anew = fits is receiver.Timing.NEW
        clock.anchor(timing.take(arrival.slot, arrival.time_ns, anew=anew))
        self._settle(arrival.slot, arrival.shift, arrival.time_ns)

    def _settle(self, slot: int, shift: int, now_ns: int) -> None:
        if slot < len(self.shifts):
            self.shifts[slot] = shift
        sample, left = divmod(slot + 1, self._terms.symbols_per_word)
        if left == 0:
            self._push_all(self._down.carry(b"", now_ns), -1, sample - 1)

    def _on_echo(self, arrival: _Arrival) -> None:
        """Take a frame of echoes up to `arrival.sample`; the older ones in it are repeats."""
        if arrival.sample - self._terms.repeats > self._expected:
            raise Uncommon("more frames in a row were lost than are repeated: a rejoin")
        while self._expected <= arrival.sample:
            if self._expected < self._samples:
                self.echo_ns[self._expected] = arrival.time_ns
            self._expected += 1
