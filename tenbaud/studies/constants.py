"""The constants of a coder and a model that are fitted, and their bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.studies.settings import StudyError, at, check_name
from tenbaud.studies.study_file import Range, described

BANDWIDTH = "transmitter.rate_observer_bandwidth_rad_s"
"""of what the transmitter makes of a coder that uses rates; it may be fitted too"""

GAINS = {"coder.gains.0": (0.2, 3.0, "log"), "coder.gains.1": (0.2, 3.0, "log")}

CODER_RANGES = {
    "zoom": {
        "coder.minimum_range_rad": (0.1, 10.0, "log"),
        "coder.decay": (0.6, 0.99, "linear"),
        **GAINS,
    },
    "fixed": {
        "coder.range_rad": (0.1, 10.0, "log"),
        **GAINS,
    },
    "open-loop-zoom": {
        "coder.minimum_range_rad": (0.1, 10.0, "log"),
        **GAINS,
    },
    "history": {
        "coder.minimum_range_rad": (0.2, 5.0, "log"),
        "coder.weights.0": (0.5, 2.0, "log"),
        "coder.weights.2": (0.5, 2.0, "log"),
    },
    "direction": {
        "coder.step": (0.7, 1.4, "log"),
        "coder.removed": (0.75, 1.25, "log"),
        "coder.initial_strength": (0.01, 100.0, "log"),
        "coder.minimum_strength": (0.1, 100.0, "log"),
    },
    "static": {"coder.gains.0": (0.1, 5.0, "log"), "coder.gains.1": (0.1, 5.0, "log")},
}
"""Constants that are fitted unless others are named; log: the ends are multiples of what is set."""

MODEL_RANGES = {
    "pitch": {
        **dict.fromkeys(("model.rate_damping_per_s", "model.stiffness_per_s2"), (0.5, 2.0, "log")),
        **dict.fromkeys(("model.torque_gain_rad_per_v_s2", "model.motor_lag_s"), (0.5, 2.0, "log")),
        "model.equilibrium_rad": (-0.4, 0.4, "linear"),
    },
    "pendulum": {
        "model.growth_per_s": (0.8, 1.25, "log"),
        "model.damping_per_s": (0.5, 2.0, "log"),
        "model.torque_gain_rad_per_v_s2": (0.5, 2.0, "log"),
    },
}


def free_ranges(config: FlightConfig, names: dict[str, Range], *, model: bool) -> dict[str, Range]:
    """Return the constants to fit: those named, or the usual ones of the coder; and of the model.

    A usual constant that is 0 stays 0: the ends are multiples of what it is. StudyError for
    names that are no constants of coder or model, and for a coder or model without usual ones.
    """
    for name in names:
        _check_constant(config, name)
    free = dict(names)
    if not free:
        usual = CODER_RANGES.get(config.coder.kind)
        if usual is None:
            raise StudyError(
                f"the coder {config.coder.kind!r} has no usual constants: name some with --free"
            )
        free = _usual(config, usual)
        if config.coder.kind == "history" and config.transmitter.rig == "replay":
            free |= _whole_table(config)
    if model:
        if config.model.kind not in MODEL_RANGES:
            raise StudyError(
                f"the model {config.model.kind!r} has no usual constants: name some with --free"
            )
        free = _usual(config, MODEL_RANGES[config.model.kind]) | free
    if not free:
        raise StudyError("every usual constant is 0 here: name some with --free")
    return free


def changed(config: FlightConfig, values: Mapping[str, float | str]) -> FlightConfig:
    """Return a configuration with other constants, by their dotted names; ConfigError for none such.

    A linear model whose A or B changes gets the F and E of its ticks.
    """
    sections: dict[str, Any] = {}
    for name, value in values.items():
        top, *path, last = name.split(".")
        here = sections.setdefault(top, getattr(config, top).model_dump(mode="json"))
        for part in path:
            here = here[int(part) if isinstance(here, list) else part]
        here[int(last) if isinstance(here, list) else last] = value
    if any(name.startswith(("model.A.", "model.B.")) for name in values):
        del sections["model"]["F"], sections["model"]["E"]
        given = {"timing": config.timing.model_dump(), "model": sections["model"]}
        sections["model"] = completed(given)["model"]
    try:
        checked = {top: type(getattr(config, top)).model_validate(sections[top]) for top in sections}
    except ValidationError as error:
        raise ConfigError(described(error)) from error
    return config.model_copy(update=checked)


def _whole_table(config: FlightConfig) -> dict[str, Range]:
    """Return what else of the coder `history` a recording says: its table, floor and observer."""
    spreads = {
        f"coder.rows.{row}.{place}": (0.4, 2.5, "log")
        for row in range(len(config.coder.rows))  # type: ignore[attr-defined]
        for place in range(3)
    }
    ranges = _usual(config, {**spreads, BANDWIDTH: (0.25, 2.5, "log")})
    floor = {"coder.floor_gain": (0.01, 0.3, "log"), "coder.floor_exponent": (0.0, 0.7, "linear")}
    for name, (first, last, scale) in floor.items():
        ranges[name] = Range.model_validate({"from": first, "to": last, "scale": scale})
    return ranges


def _usual(config: FlightConfig, spreads: dict[str, tuple[float, float, str]]) -> dict[str, Range]:
    ranges = {}
    for name, (low, high, scale) in spreads.items():
        factor = present(config, name) if scale == "log" else 1.0
        # A sign stays what it is; below 0 there is no log scale.
        if factor != 0.0:
            ends = {"from": low * factor, "to": high * factor}
            ranges[name] = Range.model_validate(ends | {"scale": scale if factor > 0.0 else "linear"})
    return ranges


def _check_constant(config: FlightConfig, name: str) -> None:
    if name.split(".")[:2] not in (["coder", "options"], ["model", "options"]):
        check_name(name)
    if name.partition(".")[0] not in ("coder", "model") and name != BANDWIDTH:
        raise StudyError(
            f"{name} is no constant of coder or model, so it is not fitted; set it, or sweep it"
        )
    present(config, name)


def present(config: FlightConfig, name: str) -> float:
    """Return what a constant is now; StudyError where there is none that can be fitted."""
    here = at(config.model_dump(mode="json"), name)
    if here is None:
        raise StudyError(f"{name} is not a constant of the coder and model that are configured")
    if isinstance(here, bool) or not isinstance(here, int | float):
        raise StudyError(f"{name} is not a number, so it cannot be fitted")
    if isinstance(here, int):
        raise StudyError(f"{name} is a whole number, which a fit cannot move; sweep it")
    return here
