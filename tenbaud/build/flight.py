"""From a configuration to the parts that it describes. Nothing is opened or started here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from channel.codec.codec import Codec
from channel.codec.downlink.machine import TwoWay
from channel.codec.signals import Signals, signals_of
from channel.line.impairments import LineFaults, parse_impairments
from channel.links.kind import LinkKind
from channel.links.registry import LINKS, link_kind
from channel.protocol.identity import Identity, numerics_probe
from channel.protocol.terms import Clock, Terms
from channel.registry import RegistryError
from receiver.controllers.base import Controller
from tenbaud.build.codec import build_codec
from tenbaud.build.downlink import build_two_way, narrowed_terms, require_effect
from tenbaud.build.liveness import RoundTrip, check_liveness, round_trip, watchdog_ticks
from tenbaud.build.parts import Parts
from tenbaud.build.references import longest_period_s
from tenbaud.build.signals import build_limits, initial_command
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.outside_code import require_allowed
from tenbaud.config.schema import FlightConfig
from tenbaud.config.version import software_version

REAL_RIGS = ("serial", "quarc", "hil")


@dataclass(frozen=True, slots=True)
class Agreement:
    """The parts that both ends build alike from their configuration."""

    config: FlightConfig
    clock: Clock
    codec: Codec
    terms: Terms
    identity: Identity
    live: bool = False
    """whether line, codec and set-point may be changed in flight, by hand"""
    parts: Parts = field(default_factory=Parts)
    """objects in place of what is configured"""
    two_way: TwoWay | None = None
    """the state machine of the narrow downlink"""
    scored_from: int | None = None
    """the tick from which errors count, where it is not the usual one"""

    @property
    def signals(self) -> Signals:
        """Return the names, units and ranges of the model's states, inputs and outputs."""
        return self.terms.signals

    @property
    def flight_ticks(self) -> int:
        samples = round(self.config.duration_s * 1e9) // self.terms.sample_ns
        return max(1, samples) * self.terms.ticks_per_sample

    @property
    def link(self) -> LinkKind:
        return kind_of_link(self.config)

    @property
    def faults(self) -> LineFaults:
        return parse_impairments(self.config.link.impairments)

    @property
    def trip(self) -> RoundTrip:
        """Return how long commands take, as far as the configuration knows."""
        return round_trip(self.terms, self.faults, self.clock)

    @property
    def watchdog_ticks(self) -> int:
        """Return the watchdog's time-out, configured or chosen."""
        return watchdog_ticks(watchdog_wanted_s(self.config), self.terms, self.trip)

    @property
    def desyncs_expected(self) -> float:
        """Return how many lockstep failures were asked for.

        An inverted bit passes the frame's 16-bit check once in 65,536 times, so raw errors on the
        downlink explain any number.
        """
        if self.faults.down.raw or self.faults.up.raw:
            return math.inf
        ends = (self.config.transmitter, self.config.receiver)
        return len([end for end in ends if end.sabotage])

    @property
    def window_start_tick(self) -> int:
        """Return where errors begin to count: after the first period of the slowest reference.

        A flight that is over by then, or that has no periodic reference, counts from its beginning.
        """
        if self.scored_from is not None:
            return self.scored_from
        recorded = self.config.receiver.controller == "recorded"
        period_s = 0.0 if recorded else longest_period_s(self.config, self.signals)
        start = round(period_s * 1e9) // self.terms.tick_ns
        return start if start < self.flight_ticks else 0


def agree(
    config: FlightConfig, clock: Clock, parts: Parts | None = None, *, recorded: bool = False
) -> Agreement:
    """Return codec, terms and identity of a configuration; ConfigError where they make no flight.

    `recorded`: of a flight that was flown, whose settings may have had no effect.
    """
    parts = parts or Parts()
    if clock == "virtual" and config.transmitter.rig in REAL_RIGS:
        raise ConfigError(
            f"the {config.transmitter.rig} rig moves in real time and has no virtual clock: "
            "add --clock real"
        )
    with config_errors():
        codec = build_codec(config, parts)
        terms = checked_terms(config, codec, clock, parts.controller)
        if not recorded:
            require_effect(config, terms)
        two_way, described = build_two_way(config, codec, terms, parts)
    shared = config.shared_json(terms.lead_ticks, described)
    identity = Identity(software_version(), shared, numerics_probe(codec, two_way))
    return Agreement(config, clock, codec, terms, identity, parts=parts, two_way=two_way)


def watchdog_wanted_s(config: FlightConfig) -> float | None:
    """Return the watchdog's time-out as configured, None where it is "auto" or a recording flies."""
    wanted = config.transmitter.watchdog_s
    return None if wanted == "auto" or config.transmitter.rig == "replay" else wanted


def checked_terms(
    config: FlightConfig, codec: Codec, clock: Clock, controller: Controller | None = None
) -> Terms:
    """Return the terms of a flight; ValueError, with the arithmetic, where they cannot be flown.

    `controller` takes the place of the configured one.
    """
    terms = build_terms(config, codec, clock, controller)
    terms.check(clock)
    trip = round_trip(terms, parse_impairments(config.link.impairments), clock)
    check_liveness(watchdog_wanted_s(config), terms, trip)
    return terms


def build_terms(
    config: FlightConfig, codec: Codec, clock: Clock, controller: Controller | None = None
) -> Terms:
    """Return the terms, with the lead chosen where it is "auto"."""
    lead = config.timing.lead_ticks
    signals = signals_of(codec.model)
    terms = Terms(
        tick_ns=round(config.timing.tick_s * 1e9),
        ticks_per_sample=codec.ticks_per_sample,
        symbols_per_word=codec.coder.alphabet.symbols_per_word,
        lead_ticks=0 if lead == "auto" else lead,
        rate_baud=config.channel.rate_baud,
        delivery=config.channel.delivery,
        deadline_allowance_ns=round(config.channel.deadline_allowance_s * 1e9),
        downlink_budget_ns=round(config.channel.downlink_budget_s * 1e9),
        repeats=config.channel.repeats,
        initial_command=initial_command(config, signals),
        limits=build_limits(config, signals),
        signals=signals,
        downlink="compact" if config.channel.downlink == "compact" else "full",
    )
    terms = narrowed_terms(config, terms, controller)
    terms = kind_of_link(config).terms(config.link, codec, terms)
    if clock == "virtual":
        terms = replace(terms, downlink_byte_ns=0)  # in its time a welcome is there at once
    if lead != "auto":
        return terms
    shortest = terms.with_shortest_lead(clock)
    delay_ns = parse_impairments(config.link.impairments).longest_delay_ns
    if not delay_ns or terms.is_mirrored:
        return shortest
    return replace(terms, lead_ticks=terms.lead_needed_ticks + -(-delay_ns // terms.tick_ns))


def kind_of_link(config: FlightConfig) -> LinkKind:
    """Return the configured kind of link; ConfigError where it is not there or not allowed."""
    if config.link.kind not in LINKS.built_in:
        require_allowed(config)
    try:
        return link_kind(config.link.kind)
    except RegistryError as error:
        raise ConfigError(str(error)) from error


def ticks_of(seconds: float, config: FlightConfig) -> int:
    """Return a time as a whole number of ticks, at least one."""
    return max(1, math.ceil(seconds / config.timing.tick_s - 1e-9))
