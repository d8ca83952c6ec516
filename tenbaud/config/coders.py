"""The kinds of coders: the section of each, and the object built from it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from channel.codec.codec import Coder, CoderContext, Model
from channel.codec.coders.base import readout_of
from channel.codec.coders.direction import DirectionCoder, DirectionParameters
from channel.codec.coders.history import HistoryCoder, HistoryParameters
from channel.codec.coders.learning import LearningCoder, LearningParameters
from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder, OpenLoopZoomParameters
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.coders.signs import Gains
from channel.codec.coders.static import StaticCoder, StaticParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.learned import LearnedModel
from channel.codec.signals import signals_of
from tenbaud.config.kinds import Kind
from tenbaud.config.section import AngleRange, Factor, KindSection, NotNegative, Positive


class _GainsSection(KindSection):
    correction: Literal["held", "impulse"] = "held"
    """held over the sample as in (22), or added to the state at once"""
    gains: tuple[Factor, Factor] = (4.1, 8.6)
    """l1 and l2 of (23): 1/s and 1/s^2 when held, per unit when impulse"""


class OpenLoopZoomCoderSection(_GainsSection):
    """One sign per sample and a range that shrinks with time: time-based zooming."""

    kind: Literal["open-loop-zoom"] = "open-loop-zoom"
    initial_range_rad: AngleRange = 0.5
    minimum_range_rad: AngleRange = 0.05
    decay: Annotated[float, Field(ge=1e-6, le=1.0)] = 0.95


class ZoomCoderSection(_GainsSection):
    """The paper's coder (16)-(22) and the observer gains."""

    kind: Literal["zoom"] = "zoom"
    window_signs: Annotated[int, Field(ge=1, le=16)] = 2
    """number of signs in the saturation test of (19); the paper's has two"""
    initial_range_rad: AngleRange = 0.5
    minimum_range_rad: AngleRange = 0.05
    decay: Annotated[float, Field(ge=1e-6, le=1.0)] = 0.95


class FixedCoderSection(_GainsSection):
    """One sign per sample and a range that never changes."""

    kind: Literal["fixed"] = "fixed"
    range_rad: AngleRange = 0.1


class StaticCoderSection(_GainsSection):
    """The measurement itself in a few bits, without memory (16)."""

    kind: Literal["static"] = "static"
    bits: Annotated[int, Field(ge=1, le=15)] = 1
    range_rad: AngleRange = 3.141592653589793
    """half the width that the cells cover"""


class PcmCoderSection(KindSection):
    """The usual loop: the angle as a word, the rate by differences. For the model `hold`."""

    kind: Literal["pcm"] = "pcm"
    bits: Annotated[int, Field(ge=1, le=15)] = 10
    range_rad: AngleRange = 3.141592653589793
    rate_filter_s: NotNegative = 0.0
    """tau of a low-pass after the differentiator; 0: none"""


class HistoryCoderSection(KindSection):
    """One sign per sample, formed with a look-ahead, decoded with the last signs; ranges in rad."""

    kind: Literal["history"] = "history"
    rows: Annotated[tuple[tuple[Factor, Factor, Factor], ...], Field(min_length=1, max_length=512)] = (
        (1.0, 0.75, 1.0),
    )
    """(angle, rate, range) of each pattern of the last signs: corrections in units of the range, the
    rate's per symbol period, and the factor of the range. Bit j of a row's number says that the
    sign j + 1 samples ago was the present one"""
    initial_range_rad: AngleRange = 0.01
    minimum_range_rad: AngleRange = 0.001
    maximum_range_rad: AngleRange = 3.0
    weights: tuple[Factor, Factor, Factor] = (0.7, 0.45, 0.75)
    """of the error after the look-ahead: angle, angle times T rate, T rate"""
    lookahead: Annotated[int, Field(ge=0, le=6)] = 1
    """samples that the transmitter looks ahead"""
    floor_gain: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """g, share per sample by which a slow mean of the range follows it; 0: fixed smallest range"""
    floor_exponent: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """c; the smallest range is minimum_range_rad times (slow mean / minimum_range_rad)^c"""


Square = Annotated[tuple[tuple[Factor, ...], ...], Field(min_length=1, max_length=64)]


class _DesignedSection(KindSection):
    """Common fields of the coders that `tenbaud design` makes for a linear plant."""

    bits: Annotated[int, Field(ge=1, le=15)] = 1
    """signs per sample"""
    adapts: bool = True
    """follow a disturbance of unknown strength; false: it is as `noise` or `noises` say"""
    transition: Square = ()
    """F of a sample, of the corrected states"""
    worth: Square = ()
    """N, cost of an error, now and later"""
    removed: Annotated[float, Field(ge=0.001, le=0.999)] = 0.67
    """alpha, share of the variance along the direction that a sign removes"""
    step: Annotated[float, Field(ge=0.001, le=10.0)] = 1.0
    """kappa, correction in standard deviations"""
    minimum_strength: Positive = 0.001
    maximum_strength: Positive = 1000.0


class DirectionCoderSection(_DesignedSection):
    """Signs in the most costly direction of the state, for any linear plant; from `tenbaud design`."""

    kind: Literal["direction"] = "direction"
    noise: Square = ()
    """Q, covariance of the disturbance's effect in a sample"""
    start: Square = ()
    """P, covariance before the first word"""
    initial_strength: Positive = 1.0
    """sigma before the first word"""


class LearningCoderSection(_DesignedSection):
    """The coder `direction` that also learns the model's terms (`learns`); from `tenbaud design`."""

    kind: Literal["learning"] = "learning"
    noises: Annotated[tuple[Square, ...], Field(max_length=16)] = ()
    """Q of each column of the disturbance"""
    starts: Annotated[tuple[Square, ...], Field(max_length=16)] = ()
    """P before the first word, of each column"""
    reach: Square = ()
    """effect of a constant rate of each state, a column, in a sample"""
    spreads: Annotated[tuple[Positive, ...], Field(max_length=64)] = ()
    """standard deviation of each term's error before the first word; empty: 0.1, of a force 0.03"""
    drift: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0003
    """largest change of an error in a sample, as a share of its spread"""
    learned_max: Annotated[float, Field(ge=0.01, le=0.9)] = 0.3
    """of the size of each error"""
    minimum_strength: Positive = 0.01


def _given(section: KindSection, model: Model | None = None) -> dict[str, Any]:
    """Return the settings of a section under the names of the coder's parameters."""
    given = section.model_dump(exclude={"kind"})
    if "correction" in given:
        given["impulse"] = given.pop("correction") == "impulse"
        given["gains"] = _gains(given["gains"], model)
    return {name.removesuffix("_rad").removesuffix("_signs"): given[name] for name in given}


def _gains(both: tuple[float, float], model: Model | None) -> Gains:
    """Return a row for each corrected state; a column for each output of which the rate is a state."""
    angle, rate = both
    if model is not None:
        signals = signals_of(model)
        states = [one.name for one in signals.states[: model.correction_size]]
        names = [one.name for one in signals.outputs]
        if len(names) > 1 and {*states} == {*names, *[f"{name}_rate" for name in names]}:
            return tuple(
                tuple(angle * (state == name) + rate * (state == f"{name}_rate") for name in names)
                for state in states
            )
    return ((angle,), (rate,))


def _fixed(section: FixedCoderSection, context: CoderContext) -> Coder:
    """Return an open-loop zoom coder whose range is at its end from the beginning."""
    given = _given(section, context.model)
    size = given.pop("range")
    return OpenLoopZoomCoder(
        OpenLoopZoomParameters(initial_range=size, minimum_range=size, decay=1.0, **given)
    )


def _pcm(section: PcmCoderSection, context: CoderContext) -> Coder:
    angles = len(context.model.measured(context.model.initial()))
    return PcmCoder(PcmParameters(period_s=context.symbol_period_s, angles=angles, **_given(section)))


def _history(section: HistoryCoderSection, context: CoderContext) -> Coder:
    return HistoryCoder(HistoryParameters(period_s=context.symbol_period_s, **_given(section)))


def _direction(section: DirectionCoderSection, context: CoderContext) -> Coder:
    if not (section.transition and section.noise and section.worth and section.start):
        raise ValueError(
            "coder.transition, noise, worth and start are missing: `tenbaud design` finds them, once "
            "and for both ends"
        )
    parameters = DirectionParameters(**_given(section))
    return _fitting(DirectionCoder(parameters, readout_of(context.model)), context)


def _learning(section: LearningCoderSection, context: CoderContext) -> Coder:
    model = context.model
    if not isinstance(model, LearnedModel):
        raise ValueError(
            "the coder 'learning' needs a model whose terms are states: set model.learns = true, which "
            "the kinds linear and helicopter have"
        )
    if not (section.transition and section.noises and section.worth and section.starts):
        raise ValueError(
            "coder.transition, noises, worth, starts and reach are missing: `tenbaud design` finds "
            "them, once and for both ends"
        )
    given = _given(section)
    given["spreads"] = section.spreads or model.spreads
    readout = [row[: len(section.transition)] for row in readout_of(model)]
    coder = LearningCoder(LearningParameters(**given), model.term_rows, model.plant.state_size, readout)
    if len(section.transition) != model.plant.correction_size:
        raise ValueError(
            f"the coder corrects {len(section.transition)} states of the plant and the model takes "
            f"corrections of {model.plant.correction_size}: design it for this model"
        )
    return _fitting(coder, context)


def _fitting(coder: DirectionCoder | LearningCoder, context: CoderContext) -> Coder:
    if coder.correction_size != context.model.correction_size:
        raise ValueError(
            f"the coder corrects {coder.correction_size} states and the model takes corrections of "
            f"{context.model.correction_size}: design it for this model"
        )
    return coder


ZOOM = Kind(
    ZoomCoderSection,
    lambda section, context: ZoomCoder(ZoomParameters(**_given(section, context.model))),
)
FIXED = Kind(FixedCoderSection, _fixed)
OPEN_LOOP_ZOOM = Kind(
    OpenLoopZoomCoderSection,
    lambda section, context: OpenLoopZoomCoder(
        OpenLoopZoomParameters(**_given(section, context.model))
    ),
)
STATIC = Kind(
    StaticCoderSection,
    lambda section, context: StaticCoder(StaticParameters(**_given(section, context.model))),
)
PCM = Kind(PcmCoderSection, _pcm)
HISTORY = Kind(HistoryCoderSection, _history)
DIRECTION = Kind(DirectionCoderSection, _direction)
LEARNING = Kind(LearningCoderSection, _learning)
