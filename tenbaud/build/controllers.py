"""The controller of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter

from channel.codec.codec import Model
from channel.codec.laws import PidConstants
from channel.codec.signals import Signals, signals_of
from receiver.controllers.base import Controller, ControllerContext
from receiver.controllers.pid import Loop, PidGains, PidLoops, Reading, Vector
from receiver.controllers.recorded import RecordedController
from receiver.controllers.references import Constant
from tenbaud.build.codec import build_model
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.plugins import build_part
from tenbaud.build.references import References, build_references
from tenbaud.build.signals import build_limits, initial_command
from tenbaud.config.controllers import PidLoopSection
from tenbaud.config.kinds import CONTROLLERS
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig


def build_controller(
    config: FlightConfig, references: References | None = None, model: Model | None = None
) -> Controller:
    """Return the controller; it follows `references` instead of the configured ones if they are given.

    `model` takes the place of the configured one.
    """
    section = config.receiver
    context = controller_context(config, model or build_model(config), references)
    controller: Controller = build_part(
        config, CONTROLLERS, section.controller, context, section.controller_options, Controller
    )
    return controller


def controller_context(
    config: FlightConfig, model: Model, references: References | None = None
) -> ControllerContext:
    """Return the context of a controller."""
    signals = signals_of(model)
    return ControllerContext(
        config.timing.tick_s,
        build_references(config, signals, model) if references is None else references,
        build_limits(config, signals).command_max,
        initial_command(config, signals),
        signals,
        model,
    )


def recorded(config: FlightConfig, context: ControllerContext) -> RecordedController:
    """Return the controller that repeats the commands of a recorded flight."""
    return RecordedController(read_flight_log(config, context.signals), len(context.signals.inputs))


def pid(config: FlightConfig, context: ControllerContext) -> PidLoops:
    """Return the PID law: one loop, or those of the list."""
    section, signals = config.receiver.pid, context.signals
    listed = [(f"receiver.pid.loops.{place}", one) for place, one in enumerate(section.loops)]
    conditional = section.anti_windup == "conditional"
    loops = [
        _loop(field, one, context, conditional, section.loops[place + 1 :])
        for place, (field, one) in enumerate(listed or [("receiver.pid", section)])
    ]
    for place, one in enumerate(section.loops):
        if one.steers:
            # The loop that is steered has the set-point that this one gives it, and no other.
            other = next(
                number
                for number, loop in enumerate(loops[place + 1 :], place + 1)
                if signals.outputs[loop.output].name == one.steers
            )
            outer, inner = loops[place], loops[other]
            constants = outer.constants._replace(
                steers=other, share=-1.0 if one.reversed else 1.0, most=one.set_point_max
            )
            loops[place] = replace(outer, constants=constants)
            loops[other] = replace(inner, reference=context.references[inner.output])
    places = [loop.output for loop in loops]
    for place in places:
        if places.count(place) > 1:
            raise ConfigError(
                f"receiver.pid.loops: two of them steer the output {signals.outputs[place].name}"
            )
    bias = section.normal_force_volts / len(signals.inputs)
    return PidLoops(loops, context.command_max, (bias,) * len(signals.inputs))


def _loop(
    field: str,
    section: PidLoopSection,
    context: ControllerContext,
    conditional: bool,
    later: Sequence[PidLoopSection],
) -> Loop:
    signals = context.signals
    with config_errors(field):
        place = signals.index("outputs", section.output) if section.output else 0
        output = signals.outputs[place]
        mixing = _mixing(section, signals, [one.output for one in later])
        factors = (section.proportional, section.integral, section.derivative)
        gains = PidGains(*factors, section.unit)
        output_unit = output.unit or "rad"
        steered = [one for one in signals.outputs if one.name == section.steers]
        steered += [one for one, share in zip(signals.inputs, mixing, strict=True) if share]
        over = steered[0].unit
        if not section.unit:
            gains = PidGains(*factors, f"{over}/{output_unit}")
        elif over and section.unit.rpartition("/")[0] != over:
            moved = f"the output {section.steers} that it steers" if section.steers else "the input"
            raise ValueError(
                f"unit = {section.unit!r}, and {moved} is in {over}, the output {output.name} in "
                f"{output_unit}: give '{over}/{output_unit}'"
            )
        constants = PidConstants(*gains.per_tick(context.tick_s, output_unit), mixing, conditional)
        value = _value_of(context, place)
        rate = _rate_of(section, context, place, value)
    reference = context.references[place] or Constant(0.0, context.tick_s)
    return Loop(constants, reference, place, value, rate)


def _mixing(section: PidLoopSection, signals: Signals, later: Sequence[str]) -> Vector:
    """Return the share of each input; without names one input has it all, and two share the push.

    `later`: outputs of the loops that this one may steer in place of inputs.
    """
    if section.steers:
        if section.inputs or section.steers not in later:
            raise ValueError(
                f"steers = {section.steers!r} takes the place of inputs, and names the output of a "
                f"loop further down the list: {', '.join(later) or 'there is none'}"
            )
        return (0.0,) * len(signals.inputs)
    if not section.inputs:
        if len(signals.inputs) > 2:
            raise ValueError(
                f"inputs names none of the {len(signals.inputs)} inputs; give the share of each that "
                f"steers, {{{signals.inputs[0].name} = 1.0}}"
            )
        return (1.0,) if len(signals.inputs) == 1 else (0.5, -0.5)
    shares = [0.0] * len(signals.inputs)
    for name, share in section.inputs.items():
        shares[signals.index("inputs", name)] = share
    if not any(shares):
        raise ValueError("inputs gives every input the share 0, so nothing would be steered")
    return tuple(shares)


def _value_of(context: ControllerContext, place: int) -> Reading:
    index = context.signals.output_states[place]
    if index is not None:
        return itemgetter(index)
    measured = context.model.measured
    return lambda state: measured(state)[place]


def _rate_of(
    section: PidLoopSection, context: ControllerContext, place: int, value: Reading
) -> Reading:
    """Return the reader of an output's rate: a state, or its difference from tick to tick."""
    signals = context.signals
    names = [one.name for one in signals.states]
    name = section.rate or f"{signals.outputs[place].name}_rate"
    if section.rate or name in names:
        return itemgetter(signals.index("states", name))
    if getattr(context.model, "signals", None) is None and len(names) > 1:
        # A model that names nothing: the angle first, then its rate.
        return itemgetter(1)
    return Difference(value, context.tick_s)


def rate_states(controller: PidLoops, signals: Signals) -> tuple[int, ...]:
    """Return for each loop the state that is its output's rate; -1: the change of the output."""
    places = tuple(float(place) for place in range(len(signals.states)))
    rates = [loop.rate for loop in controller.loops]
    return tuple([-1 if isinstance(one, Difference) else int(one(places)) for one in rates])


class Difference:
    """The change of an output from one tick to the next, per second."""

    def __init__(self, value: Reading, tick_s: float) -> None:
        self._value = value
        self._tick_s = tick_s
        self._last: float | None = None

    def __call__(self, state: Sequence[float]) -> float:
        """Return the rate at a tick; 0 at the first."""
        now = self._value(tuple(state))
        last, self._last = self._last, now
        return 0.0 if last is None else (now - last) / self._tick_s
