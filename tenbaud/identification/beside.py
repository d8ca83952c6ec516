"""References for a model from a run's bits: the simulated plant, the run's measurements."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from channel.errors import TenbaudError
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.pipeline import Identification, Options, identify
from plant_sim.identification.structures import PitchStructure
from tenbaud.build.rig import nominal_plant
from tenbaud.config.schema import FlightConfig, FlightLogSection
from tenbaud.identification.bits import Bits

TRUE = "true"
MEASURED = "measurements"

Beside: TypeAlias = dict[str, tuple[float, ...]]


def true_values(config: FlightConfig) -> tuple[float, ...]:
    """Return the parameters of the simulated pitch axis."""
    plant = nominal_plant(config).mismatched(config.transmitter.plant.mismatch)
    return (
        plant.rate_damping_per_s,
        plant.stiffness_per_s2,
        plant.torque_gain_rad_per_v_s2,
        plant.equilibrium_rad,
    )


def beside(bits: Bits, found: Identification, run: Path | None) -> Beside:
    """Return parameters in the order of `found`'s, as far as there are any to compare with."""
    config, compared = bits.config, {}
    plant = config.transmitter.plant.kind in ("auto", "pitch")
    pitches = isinstance(found.structure, PitchStructure) and config.model.kind == "pitch"
    if config.transmitter.rig == "simulated" and plant and pitches:
        compared[TRUE] = true_values(config)
    if run is not None:
        from tenbaud.identification.sources import from_log

        with suppress(IdentificationError, TenbaudError):
            log = FlightLogSection(file=str(run))
            record, _ = from_log(config.model_copy(update={"flight_log": log}), found.structure.kind)
            measured = identify(record, found.structure, Options(lag_s=found.lag_s))
            compared[MEASURED] = tuple([one.value for one in measured.parameters])
    return compared
