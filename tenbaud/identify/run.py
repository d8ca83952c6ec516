"""One identification, from a record to what a person and a configuration file need."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plant_sim.identification.crosscheck import SEGMENT_S, CrossCheck, fit
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.pitch import PitchEstimates, PitchSettings
from plant_sim.identification.record import (
    PitchIdentification,
    PitchRecord,
    identify,
    quiescent_angle,
)
from tenbaud.build.signals import build_limits, configured_signals
from tenbaud.config.schema import FlightConfig
from tenbaud.files.whole import write_whole

FIELDS = (
    ("rate_damping_per_s", "a_w", "1/s"),
    ("stiffness_per_s2", "a_th", "1/s^2"),
    ("torque_gain_rad_per_v_s2", "k_v", "rad/(V s^2)"),
    ("equilibrium_rad", "theta_0", "rad"),
)


@dataclass(frozen=True, slots=True)
class Identified:
    """The result for one record."""

    name: str
    record: PitchRecord
    result: PitchIdentification
    check: CrossCheck | None
    equilibrium_source: str
    warnings: tuple[str, ...]


def run(name: str, record: PitchRecord, equilibrium: str, settings: PitchSettings) -> Identified:
    """Identify one record. `equilibrium` is "quiet", "estimate", "auto" or a number in rad."""
    angle, source = _equilibrium(record, equilibrium)
    result = identify(record, angle, settings)
    warnings = list(result.warnings)
    check: CrossCheck | None = None
    try:
        check = fit(
            record,
            result.estimates,
            estimate_equilibrium=angle is None,
            settings=settings,
            segment_s=min(SEGMENT_S, 5.0 / settings.filter_bandwidth_rad_s),
        )
    except (IdentificationError, ValueError) as error:
        warnings.append(f"no cross-check: {error}")
    if check is not None:
        warnings += check.disagreements(result.estimates, result.deviations)
    return Identified(name, record, result, check, source, tuple(warnings))


def _equilibrium(record: PitchRecord, wanted: str) -> tuple[float | None, str]:
    if wanted == "estimate":
        return None, "estimated with the other parameters"
    if wanted in ("auto", "quiet"):
        quiet = quiescent_angle(record)
        if quiet is not None:
            span = f"{quiet.start_s:.1f} to {quiet.end_s:.1f} s"
            return quiet.angle_rad, f"rest with equal voltages, {span}"
        if wanted == "quiet":
            raise IdentificationError(
                "the record has no stretch in which the body rests and both motors pull equally; "
                "give --equilibrium in rad, or estimate"
            )
        return None, "estimated with the other parameters: the record has no quiet stretch"
    try:
        return float(wanted), "given"
    except ValueError:
        raise IdentificationError(
            f"--equilibrium {wanted}: give auto, quiet, estimate or an angle in rad"
        ) from None


def settings_of(config: FlightConfig, settle_s: float) -> PitchSettings:
    """Return the paper's constants with the lag and the saturation of a configuration."""
    return PitchSettings(
        motor_lag_s=getattr(config.model, "motor_lag_s", PitchSettings().motor_lag_s),
        volts_max=build_limits(config, configured_signals(config)).command_max[0],
        settle_s=settle_s,
    )


def model_section(estimates: PitchEstimates, settings: PitchSettings) -> dict[str, Any]:
    """Return the [model] section that both ends would fly with."""
    return {
        "kind": "pitch",
        **{field: round(getattr(estimates, field), 6) for field, _, _ in FIELDS},
        "motor_lag_s": settings.motor_lag_s,
    }


def write_config(
    path: Path, config: FlightConfig, identified: Identified, settings: PitchSettings
) -> None:
    """Write a configuration that `transmit` and `receive` take: the preset, with this model."""
    import tomli_w

    section = model_section(identified.result.estimates, settings)
    head = [f"# Identified from {identified.name}; theta_0: {identified.equilibrium_source}."]
    for field, letter, unit in FIELDS:
        spread = getattr(identified.result.deviations, field)
        head.append(f"# {letter} = {section[field]:.5g} +- {spread:.2g} {unit} (standard error)")
    head += [f"# Warning: {text}" for text in identified.warnings]
    body = {"preset": config.preset, "model": section}
    write_whole(path, "\n".join(head) + "\n" + tomli_w.dumps(body))
