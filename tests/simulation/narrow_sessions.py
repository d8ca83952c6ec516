"""Whole flights with the narrow downlink, and the same without sessions, tick by tick."""

from __future__ import annotations

from dataclasses import replace

from channel.codec.codec import ERASED, Vector, Word
from channel.codec.downlink.machine import TwoWay
from channel.line.line import Delivery
from channel.protocol.frames import DownSymbol, Symbol
from channel.protocol.terms import Terms
from channel.protocol.wire import decode, encode
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from reproduction.bothways.flights import Wants
from reproduction.bothways.lines import Faults, Line
from tenbaud import MemoryFlight
from tests.channel.codec.parts import terms
from tests.simulation.lines import CleanLine
from tests.simulation.narrow import TICKS, NarrowFlight, Pitch, square
from transmitter.rigs.base import Reading, Rig
from transmitter.session.down_symbols import NarrowFollowing

MISMATCH, NOISE = 0.1, 2e-3
CLEAN = Faults()


class Announced:
    """A programme of set-points; its command is never asked for."""

    def command(self, tick: int, state: Vector) -> Vector:
        raise AssertionError("a mirrored law decides the command")

    def references(self, tick: int) -> tuple[float | None, ...]:
        return (square(tick),)


class PushedPlant:
    """The plant of the harness."""

    def __init__(self, seed: int) -> None:
        self.pitch = Pitch(seed, NOISE, MISMATCH)

    @property
    def measured(self) -> Vector:
        return self.pitch.state[:1]

    def advance(self, command: Vector) -> None:
        self.pitch.step(command)


class ExactRig(Rig):
    """Measures what is, without an encoder."""

    name = "exact"

    def __init__(self, plant: PushedPlant) -> None:
        self._plant = plant

    def read(self, tick: int) -> Reading:
        return Reading((tick,), self._plant.measured, self._plant.measured)

    def write(self, tick: int, volts: Vector) -> None:
        self._plant.advance(volts)


class UpLine(CleanLine):
    """Loses and flips symbols as the harness does."""

    def __init__(self, line: Line, symbols: tuple[int, ...]) -> None:
        super().__init__()
        self._line, self._symbols = line, symbols

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        frame = decode(data)
        if not isinstance(frame, Symbol):
            return [Delivery(now_ns, data)]
        came = self._line.carry(self._symbols[frame.number], self._symbols)
        if came is None:
            return [Delivery(now_ns, None)]
        return [Delivery(now_ns, encode(replace(frame, number=self._symbols.index(came))))]


class DownLine(CleanLine):
    """Delivers each down symbol in its slot; loses and flips symbols as the harness does."""

    def __init__(self, line: Line, flight_terms: Terms) -> None:
        super().__init__()
        self._line, self._terms = line, flight_terms

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        frame = decode(data)
        if not isinstance(frame, DownSymbol):
            return [Delivery(now_ns, data)]
        slot_ns = max(now_ns, self._terms.down_grid.slot_ns(frame.slot))
        came = self._line.carry(frame.number, (0, 1))
        if came is None:
            return [Delivery(slot_ns, None)]
        return [Delivery(slot_ns, encode(replace(frame, number=came)))]


def narrow_terms(machine: TwoWay, *, is_mirrored: bool) -> Terms:
    """Return terms under which a sample is heard at the same tick with symbols lost and without."""
    count = machine.layout.symbols_per_sample
    return terms(lead_ticks=machine.lead_ticks, downlink_budget_ns=0).narrowed(
        10.0 * count, count, is_mirrored
    )


def memory_flight(
    machine: TwoWay, controller: Controller, seed: int, faults: Faults = CLEAN, **changes: object
) -> MemoryFlight:
    """Return a flight of both sessions; `changes` are those of MemoryFlight."""
    flight_terms = narrow_terms(machine, is_mirrored=isinstance(controller, Announced))
    plant = PushedPlant(seed)
    lines = {
        "uplink_line": UpLine(faults.up(seed), machine.codec.coder.alphabet.symbols),
        "downlink_line": DownLine(faults.down(seed), flight_terms),
    }
    as_plant: Plant = plant  # type: ignore[assignment]
    flight = MemoryFlight(
        machine.codec,
        flight_terms,
        as_plant,
        controller,
        two_way=machine,
        **{**lines, **changes},  # type: ignore[arg-type]
    )
    flight.node.rig = ExactRig(plant)
    return flight


def following_of(flight: MemoryFlight) -> NarrowFollowing:
    following = flight.transmitter.following
    assert isinstance(following, NarrowFollowing)
    return following


class TimedFlight(NarrowFlight):
    """The flight without sessions, each sample heard at its tick."""

    def __init__(
        self, machine: TwoWay, wanted: Wants, seed: int, faults: Faults, heard_ns: int
    ) -> None:
        super().__init__(machine, wanted, seed, faults, noise=NOISE, mismatch=MISMATCH, keep=True)
        self._heard_ticks = -(-heard_ns // 10_000_000)
        self._terms = narrow_terms(machine, is_mirrored=True)
        self._live_tick: int | None = None
        """at which the first down symbol is there: before it nothing is commanded"""
        self.digests: list[str] = []
        self.commands: list[Vector] = []
        self.applied: list[Vector] = []

    def _one(self) -> None:
        first = self.sample * TICKS
        for tick in range(first, first + TICKS):
            while self._arriving and tick >= self._arriving[0][0] * TICKS + self._heard_ticks:
                self._hear()
            if tick == first:
                self._send()
            assert self.hypotheses.rejoin is None
            is_live = self._live_tick is not None and tick >= self._live_tick
            volts = self.hypotheses.command(tick) if is_live else self.machine.initial_command
            self.applied.append(volts)
            self.plant.step(volts)
        self.sample += 1

    def _send(self) -> None:
        machine, word = self.machine, self.hypotheses.encode(self.plant.state[:1])
        self.hypotheses.sent(word)
        taken: Word = self._up.carry_word(word, machine.codec.coder.alphabet)
        assert taken is not ERASED or self.sample > 0, "take another seed"
        flown, symbols = machine.fly(self.state, taken, self._wanted)
        self.truth[self.sample] = (taken, symbols, self.state)
        self.state = flown.state
        self.digests.append(f"{machine.digest(self.state):016x}")
        self.commands += flown.commands
        heard = tuple([self._down.carry(one, (0, 1)) for one in symbols])
        self._arriving.append((self.sample, heard))
        for slot, one in enumerate(heard, self.sample * len(heard)):
            if self._live_tick is None and one is not None:
                self._live_tick = -(-self._terms.down_grid.slot_ns(slot) // 10_000_000)
