"""The kinds of models: the section of each, and the object built from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from channel.codec.codec import ModelContext
from channel.codec.models.hold import HoldModel
from channel.codec.models.learned import LearnedLinearModel
from channel.codec.models.linear import LinearModel
from channel.codec.models.pendulum import PendulumModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.codec.signals import PICTURES, InputSignal, Signal, Signals, named
from tenbaud.config.kinds import Kind
from tenbaud.config.section import Factor, KindSection, NotNegative, Positive


class ModelSection(KindSection):
    """Common fields of the built-in models."""

    start: tuple[Factor, ...] = ()
    """state that both ends begin with; empty: at rest, a linear model's operating state"""


class PitchModelSection(ModelSection):
    """The pitch model (11),(12) of both codecs."""

    kind: Literal["pitch"] = "pitch"
    rate_damping_per_s: Annotated[float, Field(ge=0.0, le=100.0)] = 0.1
    stiffness_per_s2: Annotated[float, Field(ge=-100.0, le=1000.0)] = 0.5
    torque_gain_rad_per_v_s2: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.35
    equilibrium_rad: Annotated[float, Field(ge=-3.2, le=3.2)] = -0.115
    motor_lag_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.08


ANGLE_DENSITY = 2e-3
"""rad^2/s^3; of the torque that designs and floors of an angle assume"""


class HoldModelSection(ModelSection):
    """No model: angle and rate stay as set by the last word. For the coder `pcm`."""

    kind: Literal["hold"] = "hold"
    outputs: Annotated[tuple[str, ...], Field(min_length=1, max_length=16)] = ("pitch",)
    """angles; the words are theirs in turn"""


Matrix = tuple[tuple[Factor, ...], ...]
Names = tuple[str, ...]
if TYPE_CHECKING:
    Picture: TypeAlias = str
else:
    Picture = Literal[("", *dict(PICTURES))]


class LinearModelSection(ModelSection):
    """A linear plant: dx/dt = A x + B u + G w, y = C x; per tick x <- F x + E u.

    About an operating point it is dx/dt = A (x - x0) + B (u - u0) + G w; y is still C x.
    """

    kind: Literal["linear"] = "linear"
    A: Matrix = ()
    B: Matrix = ()
    C: Annotated[Matrix, Field(min_length=1)]
    """rows of the outputs"""
    F: Matrix = ()
    """for the prediction at both ends: states after a tick; `tenbaud design` finds it from A"""
    E: Matrix = ()
    """effect of a command held over a tick; from A and B"""
    G: Matrix = ()
    """where the disturbance enters; empty: where the commands do"""
    densities: tuple[NotNegative, ...] = (1.0,)
    """q of the disturbance: one for each column of G, or one for all"""
    weights: tuple[NotNegative, ...] = (1.0,)
    """of the squared error of each output, or one for all"""
    corrected: Annotated[int, Field(ge=0, le=64)] = 0
    """number of states, from the first, that take corrections; 0: all"""
    operating_state: tuple[Factor, ...] = ()
    """x0, at rest under u0: where a nonlinear plant was linearised; empty: zero"""
    operating_command: tuple[Factor, ...] = ()
    """u0; empty: zero"""
    states: Names = ()
    state_units: Names = ()
    inputs: Names = ()
    input_units: Names = ()
    outputs: Names = ()
    output_units: Names = ()
    input_steps_per_unit: tuple[Positive, ...] = ()
    """a command is sent in whole steps: 1000 per volt are mV; empty: 1000"""
    learns: bool = False
    """whether errors of A and B, and a constant force, are states that the coder `learning` corrects"""
    picture: Picture = ""
    """picture in displays, its parts turned by the outputs in order; empty: a bar for each output"""

    def signals(self, inputs: int) -> Signals:
        """Return names and units; an output that is a state is called like it, others are numbered."""

        def given(what: str, count: int) -> list[tuple[str, str]]:
            names = getattr(self, f"{what}s") or [one.name for one in named(what, count)]
            return list(zip(names, getattr(self, f"{what}_units") or [""] * count, strict=True))

        steps = self.input_steps_per_unit or (1000.0,) * inputs
        states, outputs = given("state", len(self.C[0])), given("output", len(self.C))
        seen = [_state_of(row) for row in self.C]
        once = bool(self.states) and not self.outputs and len({*seen}) == len(seen)
        for number, place in enumerate(seen):
            if place is None:
                continue
            (name, unit), (state, state_unit) = outputs[number], states[place]
            if unit and state_unit not in ("", unit):
                raise ValueError(
                    f"units contradict: the output {name} is the state {state}, and they are in {unit} "
                    f"and {state_unit}"
                )
            outputs[number] = (state if once else name, unit or state_unit)
        return Signals(
            tuple(Signal(*one) for one in states),
            tuple(
                InputSignal(*one, steps_per_unit=step)
                for one, step in zip(given("input", inputs), steps, strict=True)
            ),
            tuple(Signal(*one) for one in outputs),
            tuple(seen),
            self.picture,
            self.C if any(_state_of(row) is None for row in self.C) else (),
        )

    @model_validator(mode="after")
    def _fitting(self) -> LinearModelSection:
        size = len(self.C[0])
        transition, drive = ("A", "B") if self.A else ("F", "E")
        columns = len((getattr(self, drive) or ((),))[0])
        shapes = {transition: (size, size), drive: (size, columns), "C": (len(self.C), size)}
        if self.A and self.F:
            shapes |= {"F": (size, size), "E": (size, columns)}
        if self.G:
            shapes["G"] = (size, len(self.G[0]))
        for name, (height, width) in shapes.items():
            matrix = getattr(self, name)
            if len(matrix) != height or any(len(row) != width for row in matrix) or not width:
                found = " and ".join(sorted({str(len(row)) for row in matrix})) or "0"
                raise ValueError(
                    f"{name} must have {height} rows of {width or 1} numbers, as C has {size} columns; "
                    f"it has {len(matrix)} rows of {found}"
                )
        _check_length("densities", self.densities, len(self.G[0]) if self.G else columns, 1)
        _check_length("weights", self.weights, len(self.C), 1)
        _check_length("start", self.start, size, 0)
        _check_length("operating_state", self.operating_state, size, 0)
        _check_length("operating_command", self.operating_command, columns, 0)
        if self.corrected > size:
            raise ValueError(f"corrected is {self.corrected}, and there are {size} states")
        for name, count in (("state", size), ("input", columns), ("output", len(self.C))):
            _check_length(f"{name}s", getattr(self, f"{name}s"), count, 0)
            _check_length(f"{name}_units", getattr(self, f"{name}_units"), count, 0)
        _check_length("input_steps_per_unit", self.input_steps_per_unit, columns, 0)
        self.signals(columns)
        return self


def _state_of(row: tuple[float, ...]) -> int | None:
    """Return which state an output is, None for another function of them."""
    one = [index for index, value in enumerate(row) if value]
    return one[0] if len(one) == 1 and row[one[0]] == 1.0 else None


def _check_length(name: str, values: tuple[object, ...], count: int, default: int) -> None:
    if len(values) not in (count, default):
        raise ValueError(f"{name} has {len(values)} entries, and {count} are needed")


class PendulumModelSection(ModelSection):
    """An inverted pendulum, upright at angle 0 and pushed by one motor: unstable."""

    kind: Literal["pendulum"] = "pendulum"
    growth_per_s: Annotated[float, Field(ge=0.1, le=100.0)] = 7.32
    """lambda: errors grow by exp(lambda) a second"""
    damping_per_s: Annotated[float, Field(ge=0.0, le=100.0)] = 0.1
    torque_gain_rad_per_v_s2: Annotated[float, Field(ge=-100.0, le=100.0)] = 4.0


def _pitch(section: PitchModelSection, context: ModelContext) -> PitchModel:
    parameters = PitchParameters(**section.model_dump(exclude={"kind", "start"}))
    return PitchModel(parameters, context.tick_s, section.start)


def _hold(section: HoldModelSection, context: ModelContext) -> HoldModel:
    return HoldModel(context.tick_s, section.start, section.outputs)


def freshness(context: ModelContext) -> float:
    """Return how far a term's mean moves to its value in a tick: in half a symbol period."""
    return min(1.0, 2.0 * context.tick_s / context.symbol_period_s)


def _linear(section: LinearModelSection, context: ModelContext) -> LinearModel | LearnedLinearModel:
    if not section.F:
        raise ValueError(
            "model.F and model.E, the plant of one tick, are missing: `tenbaud design` finds them from "
            "A and B, once and for both ends"
        )
    operating = (section.operating_state, section.operating_command)
    model = LinearModel(
        section.F,
        section.E,
        section.C,
        context.tick_s,
        corrected=section.corrected or None,
        start=section.start or None,
        operating=operating,
        signals=section.signals(len(section.E[0])),
    )
    if not section.learns:
        return model
    if not section.A:
        raise ValueError("model.learns is of the entries of A and B, which are not given")
    return LearnedLinearModel(model, section.A, section.B, operating, freshness(context))


def _pendulum(section: PendulumModelSection, context: ModelContext) -> PendulumModel:
    return PendulumModel(context, **section.model_dump(exclude={"kind"}))


def _angle(name: str, stiffness: float, damping: float) -> LinearModelSection:
    """Return an angle that a torque pushes."""
    return LinearModelSection(
        A=((0.0, 1.0), (-stiffness, -damping)),
        B=((0.0,), (1.0,)),
        C=((1.0, 0.0),),
        densities=(ANGLE_DENSITY,),
        states=(name, f"{name}_rate"),
        state_units=("rad", "rad/s"),
    )


PENDULUM = Kind(
    PendulumModelSection,
    _pendulum,
    plant="pendulum",
    linear=lambda section: _angle("angle", -(section.growth_per_s**2), section.damping_per_s),
)
PITCH = Kind(
    PitchModelSection,
    _pitch,
    linear=lambda section: _angle("pitch", section.stiffness_per_s2, section.rate_damping_per_s),
    may_grow=lambda section: section.stiffness_per_s2 < 0.0,
)
HOLD = Kind(HoldModelSection, _hold)
LINEAR = Kind(LinearModelSection, _linear, plant="linear", linear=lambda section: section)
