"""The timing that both ends agree on: ticks, samples, slots, lead.

A *tick* is one step of model and control (`h`). A *sample* is `N` ticks (`T_s = N h`) and has one
word; each of its symbols takes one *slot* of the uplink. Flight time is in nanoseconds from tick 0,
as integers, so that the two clocks and the virtual one never disagree by a rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from channel.codec.codec import Codec, Vector
from channel.codec.downlink.layout import Layout, symbols_carried
from channel.codec.signals import Signals, signals_of
from channel.protocol.limits import CommandLimits, require_carried, require_movable, steps_held
from channel.protocol.lockstep import HISTORY_NS, HISTORY_SAMPLES

Delivery = Literal["start", "end"]
Clock = Literal["real", "virtual"]
Rung = Literal["full", "compact", "narrow"]
"""What a downlink spends on a sample."""

# What a command frame can hold (channel/protocol/wire.py): 16 KiB, its echoes counted in one byte.
ECHO_BYTES = 10
ECHOES_MAX = 255
ECHOES_BYTES_MAX = 16_000

NARROW_LAG_SAMPLES = 512
"""By how many samples confirmations of the narrow downlink may lag, beyond what is given up."""


class SlotGrid(NamedTuple):
    """The slots of one direction, in flight time."""

    start_ns: int
    """when slot 0 begins"""
    sample_ns: int
    slots: int
    """of a sample"""
    delivery_ns: int
    """how long after its slot begins a symbol is delivered, by agreement"""
    line_ns: int
    """how long a line of finite rate takes for it"""
    allowance_ns: int
    """how long after its due time it may come"""
    ahead_ns: int
    """how long before its slot a symbol may be offered"""

    def slot_ns(self, slot: int) -> int:
        """Return when a slot begins."""
        return self.start_ns + slot * self.sample_ns // self.slots

    def due_ns(self, slot: int) -> int:
        """Return when a slot's symbol is due at the other end."""
        return self.slot_ns(slot) + self.delivery_ns + self.line_ns

    @property
    def length_ns(self) -> float:
        """Return how long a slot lasts."""
        return self.sample_ns / self.slots


@dataclass(frozen=True, slots=True)
class Terms:
    """The agreed timing of a flight, checked for sense."""

    tick_ns: int
    ticks_per_sample: int
    """N"""
    symbols_per_word: int
    """b, the slots of one sample"""
    lead_ticks: int
    """D: the command of tick n + D is decided when the codec stands at tick n"""
    rate_baud: float
    """R: symbols per second that the uplink may carry"""
    delivery: Delivery
    """"start": a symbol is there when its slot begins (the paper); "end": when its slot is over"""
    deadline_allowance_ns: int
    """how long after its due time a symbol may come before its slot is taken for erased"""
    downlink_budget_ns: int
    """time set aside for a command frame to reach the plant"""
    repeats: int
    """W: how many earlier samples each command frame repeats"""
    initial_command: Vector
    """command of ticks 0 ... D - 1"""
    limits: CommandLimits
    signals: Signals
    """of the codec's model"""
    downlink: Rung = "full"
    """"compact": one command a sample, in frames of few bits (`channel.protocol.compact`); "narrow":
    symbols on a slot grid (`channel.codec.downlink`)"""
    downlink_baud: float = 0.0
    """R_d of the narrow downlink: symbols per second that it may carry"""
    down_symbols: int = 0
    """of the narrow downlink: the slots of one sample"""
    is_mirrored: bool = False
    """whether the law runs in the state machine of both ends, so that no command is waited for"""
    uplink_line_ns: int = 0
    """on a line of finite rate: how long a symbol is on its way"""
    downlink_line_ns: int = 0
    """on a line of finite rate: how long a command frame, or a down symbol, is on its way"""
    downlink_byte_ns: int = 0
    """on a line of finite rate: how long a byte takes on the way down"""

    @classmethod
    def for_codec(
        cls,
        codec: Codec,
        tick_s: float,
        *,
        rate_baud: float | None = None,
        delivery: Delivery = "start",
        lead_ticks: int | None = None,
        deadline_allowance_s: float = 0.02,
        downlink_budget_s: float = 0.01,
        repeats: int = 2,
        initial_command: Vector | None = None,
        limits: CommandLimits | None = None,
        downlink: Rung = "full",
        downlink_baud: float = 20.0,
        is_mirrored: bool = False,
    ) -> Terms:
        """Return the terms on which a codec flies with ticks of `tick_s` on the virtual clock.

        Without more, the line carries just the symbols that the codec asks for, commands begin at zero,
        and the command lead is the shortest that is possible. `downlink_baud` and `is_mirrored` are of
        the narrow downlink. ValueError where they cannot be flown.
        """
        symbols_per_word = codec.coder.alphabet.symbols_per_word
        signals = signals_of(codec.model)
        tick_ns = round(tick_s * 1e9)
        terms = cls(
            tick_ns=tick_ns,
            ticks_per_sample=codec.ticks_per_sample,
            symbols_per_word=symbols_per_word,
            lead_ticks=lead_ticks or 0,
            rate_baud=rate_baud or 1e9 * symbols_per_word / (tick_ns * codec.ticks_per_sample),
            delivery=delivery,
            deadline_allowance_ns=round(deadline_allowance_s * 1e9),
            downlink_budget_ns=round(downlink_budget_s * 1e9),
            repeats=repeats,
            initial_command=initial_command or (0.0,) * codec.model.input_size,
            limits=limits or CommandLimits.of(signals),
            signals=signals,
            downlink=downlink,
        )
        if downlink == "narrow":
            count = symbols_carried(downlink_baud, terms.sample_ns)
            terms = terms.narrowed(downlink_baud, count, is_mirrored)
        if lead_ticks is None:
            terms = terms.with_shortest_lead("virtual")
        terms.check("virtual")
        return terms

    def narrowed(self, downlink_baud: float, down_symbols: int, is_mirrored: bool) -> Terms:
        """Return these terms with a narrow downlink."""
        return replace(
            self,
            downlink="narrow",
            downlink_baud=downlink_baud,
            down_symbols=down_symbols,
            is_mirrored=is_mirrored,
        )

    @property
    def sample_ns(self) -> int:
        """Return the symbol period `T_s`."""
        return self.tick_ns * self.ticks_per_sample

    @property
    def uplink_delivery_ns(self) -> int:
        """Return how long after a sample's first tick its word is complete at the receiver."""
        slots = self.symbols_per_word - 1 + (self.delivery == "end")
        return slots * self.sample_ns // self.symbols_per_word

    @property
    def symbol_delay_ns(self) -> int:
        """Return how long the line takes to deliver one symbol."""
        return self.slot_ns(1) if self.delivery == "end" else 0

    def slot_ns(self, slot: int) -> int:
        """Return the flight time at which a slot begins."""
        return slot * self.tick_ns * self.ticks_per_sample // self.symbols_per_word

    @property
    def up_grid(self) -> SlotGrid:
        """Return the slots of the uplink."""
        return SlotGrid(
            start_ns=0,
            sample_ns=self.sample_ns,
            slots=self.symbols_per_word,
            delivery_ns=self.symbol_delay_ns,
            line_ns=self.uplink_line_ns,
            allowance_ns=self.deadline_allowance_ns,
            ahead_ns=self.sample_ns,
        )

    @property
    def down_grid(self) -> SlotGrid:
        """Return the slots of the narrow downlink.

        The receiver has settled a sample's word by the first slot of the sample. Where the word came
        early it did so up to one sample and one allowance before, and offered all symbols then.
        """
        sample_ns, count = self.sample_ns, self.down_symbols
        return SlotGrid(
            start_ns=self.uplink_delivery_ns + self.uplink_line_ns + self.deadline_allowance_ns,
            sample_ns=sample_ns,
            slots=count,
            delivery_ns=sample_ns // count if self.delivery == "end" else 0,
            line_ns=self.downlink_line_ns,
            allowance_ns=self.downlink_budget_ns,
            ahead_ns=2 * sample_ns + self.deadline_allowance_ns,
        )

    @property
    def is_narrow(self) -> bool:
        """Return whether symbols go down, and no frames of commands."""
        return self.downlink == "narrow"

    @property
    def heard_ns(self) -> int:
        """Return how long after a sample's first tick its commands, or down symbols, have come."""
        word_ns = self.uplink_delivery_ns + self.uplink_line_ns + self.deadline_allowance_ns
        if not self.is_narrow:
            return word_ns + self.downlink_line_ns + self.downlink_budget_ns
        grid = self.down_grid
        return grid.due_ns(grid.slots - 1) + grid.allowance_ns

    def linger_ns(self, line_delay_ns: int) -> int:
        """Return how long after a flight's last tick its last echo may come.

        `line_delay_ns`: by how much the two lines may delay messages beyond what is agreed here.
        """
        return self.heard_ns + self.symbol_delay_ns + line_delay_ns

    def samples_in(self, time_ns: int, at_least: int) -> int:
        """Return a time as a number of samples, rounded up, and no fewer than `at_least`."""
        return max(at_least, -(-time_ns // self.sample_ns))

    @property
    def history_samples(self) -> int:
        """Return by how many samples echoes may lag and symbols may jump ahead."""
        return self.samples_in(HISTORY_NS, HISTORY_SAMPLES)

    @property
    def confirmation_samples(self) -> int:
        """Return by how many samples confirmations may lag."""
        return max(NARROW_LAG_SAMPLES if self.is_narrow else 0, self.history_samples)

    @property
    def lead_needed_ticks(self) -> int:
        """Return the smallest `D` with which every command can be in time on a real clock."""
        if self.is_mirrored:
            return 0
        return max(0 if self.is_narrow else 1, -(-self.heard_ns // self.tick_ns))

    def with_shortest_lead(self, clock: Clock) -> Terms:
        """Return these terms with the smallest lead that `check` allows on this clock."""
        ideal = clock == "virtual" and self.uplink_delivery_ns == 0 and not self.is_narrow
        return replace(self, lead_ticks=0 if ideal else self.lead_needed_ticks)

    def check(self, clock: Clock) -> None:
        """Raise ValueError, with the arithmetic, where these terms cannot be flown."""
        slots_per_s = 1e9 * self.symbols_per_word / self.sample_ns
        if slots_per_s > self.rate_baud * (1.0 + 1e-9):
            raise ValueError(
                f"{self.symbols_per_word} symbol(s) every {self.sample_ns / 1e9:g} s ask for "
                f"{slots_per_s:g} symbols/s, but the line carries rate_baud = {self.rate_baud:g}; "
                "lengthen symbol_period_s or raise rate_baud"
            )
        inputs = len(self.signals.inputs)
        if not inputs == len(self.initial_command) == len(self.limits.command_max):
            raise ValueError(
                f"the plant has {inputs} input(s); the initial command has {len(self.initial_command)} "
                f"value(s) and there are {len(self.limits.command_max)} limit(s)"
            )
        require_carried("the initial command", self.initial_command, self.signals)
        if self.is_narrow:
            Layout(self.down_symbols, command_period=2).check_rate(self.downlink_baud, self.sample_ns)
        compact = self.downlink == "compact"
        per_step = steps_held(self.limits, self.signals) if compact else (1,) * inputs
        require_movable(self.limits, self.signals, per_step)
        echo_bytes = ECHO_BYTES + 2 * len(self.initial_command) * self.ticks_per_sample
        if (self.repeats + 1) * echo_bytes > ECHOES_BYTES_MAX or self.repeats >= ECHOES_MAX:
            raise ValueError(
                f"a command frame of 1 + repeats = {self.repeats + 1} echoes, {echo_bytes} bytes each, "
                f"would be too long: at most {ECHOES_MAX} echoes and {ECHOES_BYTES_MAX} bytes; lower "
                "repeats"
            )
        ideal = clock == "virtual" and self.lead_ticks == 0 and self.uplink_delivery_ns == 0
        if ideal or self.lead_ticks >= self.lead_needed_ticks:
            return
        if self.lead_ticks == 0 and clock == "real":
            problem = "lead_ticks = 0 exists on the virtual clock only"
        else:
            problem = f"lead_ticks = {self.lead_ticks} is too short"
        raise ValueError(
            f"{problem}: {self._lead_parts()} need lead_ticks >= {self.lead_needed_ticks} at "
            f"{self.tick_ns / 1e6:g} ms a tick"
        )

    def _lead_parts(self) -> str:
        """Return what a command waits for."""
        if self.is_narrow:
            return f"down symbols, which are all there {self.heard_ns / 1e6:.4g} ms after a sample,"
        line = ""
        if self.uplink_line_ns or self.downlink_line_ns:
            line = (
                f" + {self.uplink_line_ns / 1e6:.3g} ms for a symbol and "
                f"{self.downlink_line_ns / 1e6:.3g} ms for a command frame on the serial line"
            )
        return (
            f"uplink delivery {self.uplink_delivery_ns / 1e6:g} ms + deadline allowance "
            f"{self.deadline_allowance_ns / 1e6:g} ms + downlink budget "
            f"{self.downlink_budget_ns / 1e6:g} ms{line}"
        )
