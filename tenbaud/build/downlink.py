"""The two-way state machine of the narrow downlink, from a configuration or from objects.

With the scheme "auto" the laws that are built in are mirrored, and every other controller's commands
are coded. All that the state machine was built from is shared, numbers by value.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import asdict
from typing import Any, NamedTuple

from channel.codec.codec import Codec, Vector
from channel.codec.downlink.coded import CodedCommands, CodedDirection
from channel.codec.downlink.laws import MirroredFeedback, MirroredLoop, MirroredPid, check_law
from channel.codec.downlink.layout import Layout, symbols_carried
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import Law, MirroredLaw
from channel.codec.laws import FeedbackLaw
from channel.line.impairments import parse_impairments
from channel.protocol.terms import Terms
from receiver.controllers.base import Controller
from receiver.controllers.pid import PidLoops
from receiver.controllers.state_feedback import StateFeedback
from tenbaud.build.controllers import build_controller, rate_states
from tenbaud.build.parts import Parts
from tenbaud.build.references import ANNOUNCED_SAMPLES_MAX
from tenbaud.build.set_point_ranges import set_point_ranges
from tenbaud.config.downlink import OF_SCHEME, DownlinkSection, StateLawSection
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig

DESIGNED = "state_feedback"
MIRRORED = ("pid", DESIGNED)
"""Controllers that are built in as laws in the codec's arithmetic."""
Description = dict[str, Any]


class BuiltDownlink(NamedTuple):
    """The state machine, and what it was built from, for the shared configuration; None: not narrow."""

    two_way: TwoWay | None
    description: Description | None


def narrowed_terms(config: FlightConfig, terms: Terms, controller: Controller | None) -> Terms:
    """Return the terms with the configured narrow downlink, as they are with any other."""
    if config.channel.downlink != "narrow":
        return terms
    baud, count = config.channel.downlink_baud, config.downlink.symbols_per_sample
    if count == "auto":
        count = symbols_carried(baud, terms.sample_ns)
    return terms.narrowed(baud, count, _is_mirrored(config, controller))


def _is_mirrored(config: FlightConfig, controller: Controller | None) -> bool:
    scheme = config.downlink.scheme
    if scheme != "auto":
        return scheme == "mirrored"
    if controller is not None:
        return isinstance(controller, PidLoops | StateFeedback)
    return config.receiver.controller in MIRRORED


def designed_law(config: FlightConfig) -> Description | None:
    """Return the section `downlink.law`; None where no state feedback runs at both ends."""
    narrow, designed = config.channel.downlink == "narrow", config.receiver.controller == DESIGNED
    if not (narrow and designed and _is_mirrored(config, None)):
        return None
    controller = build_controller(config)
    assert isinstance(controller, StateFeedback)
    return controller.law._asdict()


def build_two_way(
    config: FlightConfig, codec: Codec, terms: Terms, parts: Parts | None = None
) -> BuiltDownlink:
    """Return the state machine of the narrow downlink, if it is narrow.

    `parts` take the place of the configured ones. ConfigError for what cannot be flown.
    """
    if not terms.is_narrow:
        return BuiltDownlink(None, None)
    with config_errors("the narrow downlink"):
        layout = _layout(config.downlink, terms)
        build = _mirrored if terms.is_mirrored else _coded
        scheme, description = build(config, codec, terms, layout, parts or Parts())
        two_way = TwoWay(
            codec,
            scheme,
            layout,
            terms.lead_ticks,
            terms.initial_command,
            terms.limits.command_max,
            terms.limits.slew_per_tick,
        )
    return BuiltDownlink(two_way, {"layout": asdict(layout), **description})


def with_codec(two_way: TwoWay | None, codec: Codec) -> TwoWay | None:
    """Return the same state machine with an end's own codec; None where there is none."""
    if two_way is None or two_way.codec is codec:
        return two_way
    own = copy(two_way)
    own.codec = codec
    return own


def said_by_words(two_way: TwoWay | None) -> dict[int, tuple[float, float]]:
    """Return the least and the largest set-point of each output that is steered by words."""
    ranges = two_way.scheme.ranges if two_way and isinstance(two_way.scheme, MirroredLaw) else ()
    return {one.output: (one.low, one.high) for one in ranges}


def require_effect(config: FlightConfig, terms: Terms) -> None:
    """Raise ConfigError for a setting of the narrow downlink that would change nothing."""
    section, fields = config.downlink, DownlinkSection.model_fields
    if not terms.is_narrow:
        return
    flown, other = ("mirrored", "coded") if terms.is_mirrored else ("coded", "mirrored")
    unused = [one for one in OF_SCHEME[other] if getattr(section, one) != fields[one].default]
    if unused:
        names = ", ".join(f"downlink.{one}" for one in unused)
        raise ConfigError(
            f'{names}: only for the scheme "{other}"; downlink.scheme = "{section.scheme}" with the '
            f'controller {config.receiver.controller} is "{flown}": leave it out, or set '
            f'downlink.scheme = "{other}"'
        )


def _layout(section: DownlinkSection, terms: Terms) -> Layout:
    period = section.command_period
    if period == "auto":
        shortest = 4 if terms.is_mirrored else 1
        period = 2 * shortest if terms.down_symbols == 1 else shortest
    return Layout(terms.down_symbols, section.command_symbols, period)


def _mirrored(
    config: FlightConfig, codec: Codec, terms: Terms, layout: Layout, parts: Parts
) -> tuple[MirroredLaw, Description]:
    """Return the scheme with the law in it."""
    controller = parts.controller or build_controller(config, model=codec.model)
    given = parts.controller if parts.has_own_set_points else None
    law, described = _law(config, controller, codec, terms)
    ranges = set_point_ranges(config, codec, terms.signals, given)
    bits, outputs = config.downlink.bits, len(terms.signals.outputs)
    shortest = MirroredLaw(law, ranges, outputs, bits, 0, layout)
    queue = _queue(config, terms, shortest.queue_needed)
    scheme = MirroredLaw(law, ranges, outputs, bits, queue, layout)
    return scheme, {
        "scheme": "mirrored",
        "bits": bits,
        "announced_samples": queue,
        "set_points": {
            terms.signals.outputs[one.output].name: [one.low, one.high, one.start] for one in ranges
        },
        "law": described,
    }


def _queue(config: FlightConfig, terms: Terms, needed: int) -> int:
    """Return how many samples after a set-point changes it takes effect."""
    announce_s = config.downlink.announce_s
    if announce_s != "auto":
        samples = round(announce_s * 1e9 / terms.sample_ns)
        if samples > ANNOUNCED_SAMPLES_MAX:
            raise ConfigError(
                f"downlink.announce_s = {announce_s:g} is {samples} samples, more than the "
                f"{ANNOUNCED_SAMPLES_MAX} that both ends keep"
            )
        return samples
    # The transmitter has to know it in time as well.
    trip_ns = terms.heard_ns + parse_impairments(config.link.impairments).longest_delay_ns
    late_ns = trip_ns - terms.sample_ns - terms.lead_ticks * terms.tick_ns
    return needed + max(0, -(-late_ns // terms.sample_ns))


def _law(
    config: FlightConfig, controller: Controller, codec: Codec, terms: Terms
) -> tuple[Law, Description]:
    """Return a controller's law as both ends run it, and its numbers."""
    largest, tick_s = terms.limits.command_max, config.timing.tick_s
    if config.downlink.law != StateLawSection() and not isinstance(controller, StateFeedback):
        raise ConfigError(
            "downlink.law has the numbers of a state feedback, and the controller is "
            f'{config.receiver.controller}: leave it out, or set receiver.controller = "{DESIGNED}"'
        )
    if isinstance(controller, PidLoops):
        rates = rate_states(controller, terms.signals)
        loops = tuple(
            [
                MirroredLoop(one.constants, one.output, rate, one.reference is not None)
                for one, rate in zip(controller.loops, rates, strict=True)
            ]
        )
        numbers = [[*one.constants, *one[1:]] for one in loops]
        law = MirroredPid(loops, largest, controller.bias, tick_s)
        return law, {"loops": numbers, "bias": controller.bias}
    if isinstance(controller, StateFeedback):
        section = config.downlink.law
        numbers_of = controller.law
        if section != StateLawSection():
            numbers_of = FeedbackLaw(**{name: getattr(section, name) for name in FeedbackLaw._fields})
            _check_shape(numbers_of, controller.law)
        return MirroredFeedback(numbers_of, largest, tick_s), numbers_of._asdict()
    name = config.receiver.controller
    own: Law | None = getattr(controller, "mirrored", None)
    if own is None:
        raise ConfigError(
            f'downlink.scheme = "mirrored" needs a law that both ends can run, and the controller '
            f"{name} has none: give it an attribute `mirrored` (docs/extend.md), or set scheme = "
            '"coded"'
        )
    check_law(own, codec.model)
    return own, {"controller": name, "options": config.receiver.controller_options}


def _check_shape(given: FeedbackLaw, designed: FeedbackLaw) -> None:
    """Raise ConfigError for a law by value that does not fit the plant."""
    for name in ("base", "gains", "forward", "integral_gains"):
        rows, like = getattr(given, name), getattr(designed, name)
        if _shape(rows) != _shape(like):
            raise ConfigError(f"downlink.law.{name} has the shape {_shape(rows)}, not {_shape(like)}")


def _shape(rows: Sequence[Any]) -> list[Any]:
    return [len(rows), *{len(row) for row in rows if isinstance(row, tuple)}]


def _coded(
    config: FlightConfig, codec: Codec, terms: Terms, layout: Layout, parts: Parts
) -> tuple[CodedCommands, Description]:
    """Return the scheme for commands of any controller."""
    section, largest = config.downlink, terms.limits.command_max
    count, states = len(largest), codec.model.state_size
    rows = section.directions or tuple(
        [tuple([1.0 if place == at else 0.0 for place in range(count)]) for at in range(count)]
    )
    for name, given_rows, height, width in (
        ("directions", rows, len(rows), count),
        ("feedback", section.feedback, len(rows), states),
    ):
        if given_rows and (len(given_rows) != height or {len(row) for row in given_rows} != {width}):
            raise ConfigError(
                f"downlink.{name} has {len(given_rows)} row(s) of "
                f"{', '.join(str(len(row)) for row in given_rows)} numbers; there are {len(rows)} "
                f"direction(s), {count} input(s) and {states} state(s)"
            )
    if not section.range_min <= section.range_max <= section.value_max:
        raise ConfigError(
            f"downlink.range_min = {section.range_min:g}, range_max = {section.range_max:g} and "
            f"value_max = {section.value_max:g} must rise in this order"
        )
    directions = []
    for place, (row, read) in enumerate(zip(rows, _readings(rows), strict=True)):
        most = 0.0
        for share, limit in zip(read, largest, strict=True):
            most += abs(share) * limit
        least = section.range_min * most
        feedback = section.feedback[place] if section.feedback else ()
        directions.append(
            CodedDirection(
                row, read, feedback, least, least, section.range_max * most, section.value_max * most
            )
        )
    scheme = CodedCommands(terms.initial_command, directions, section.turns)
    return scheme, {
        "scheme": "coded",
        "directions": [one._asdict() for one in directions],
        "turns": scheme.turns,
    }


def _readings(rows: Sequence[Vector]) -> list[Vector]:
    """Return for each direction the row that gives its value back from the inputs."""
    import numpy as np

    matrix = np.array(rows, dtype=np.float64)
    if np.linalg.matrix_rank(matrix) < len(rows):
        raise ConfigError(
            f"downlink.directions {[list(row) for row in rows]}: a row is zero, or a sum of others; no "
            "symbol can be about it, so leave it out"
        )
    # Rounded, as two libraries differ in the last digits: ranges follow from it at both ends.
    inverse = np.linalg.pinv(matrix).T
    return [tuple([float(f"{value:.10g}") + 0.0 for value in row]) for row in inverse.tolist()]
