"""`tenbaud.identify`: from a file or arrays to a model, and to a configuration that flies it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from channel.codec.signals import Signals
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.pipeline import OF_A_LOG, Options
from plant_sim.identification.record import Record
from plant_sim.identification.regression import Filters
from plant_sim.identification.structures import PitchStructure
from tenbaud.build.signals import build_limits, configured_signals
from tenbaud.config.load import given_names, load_config, nested
from tenbaud.config.schema import FlightConfig, FlightLogSection
from tenbaud.identification import written
from tenbaud.identification.beside import TRUE, Beside, beside, true_values
from tenbaud.identification.bits import Bits, run_bits
from tenbaud.identification.closed_loop import with_commands
from tenbaud.identification.flown import Flown, fly_record, with_coder
from tenbaud.identification.run import Identified, Wanted, run
from tenbaud.identification.sources import Source, from_arrays, from_bits, from_log, from_rig

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

EXCITATIONS = ("square:0.2,0,2.5", "square:0.25,0.1,3")
DURATION_S = 60.0
SHARED = ("limits.command_max", "limits.command_slew_per_s", "transmitter.encoders.")
"""settings of a run that stay, as both ends know them"""


@dataclass(frozen=True, slots=True)
class Request:
    """The options, as on the command line."""

    structure: str = ""
    lag: str = "auto"
    equilibrium: str = "auto"
    bandwidth_rad_s: float | None = None
    damping: float = 0.7
    forgetting_per_s: float | None = None
    fly: bool = True
    given: frozenset[str] = frozenset()
    """full names of the settings that a person gives; "preset" where one is named"""
    from_bits: bool = False
    """use only the transmitted data of a run"""


@dataclass(slots=True, eq=False)
class Each:
    """The result for one record."""

    identified: Identified
    source: Source
    settings: dict[str, Any]
    """a whole configuration; empty where the data support no model, or no flight"""
    flown: Flown | None = None
    config_file: Path | None = None
    beside: Beside = field(default_factory=dict)
    """parameters to compare with, by where they are from; empty but for a run's bits"""

    @property
    def config(self) -> FlightConfig:
        """Return the configuration that flies the identified model; IdentificationError without one."""
        if not self.settings:
            raise IdentificationError("; ".join(self.refused or self.warnings))
        return load_config(self.settings["preset"], None, self.settings)

    @property
    def model(self) -> dict[str, Any]:
        """Return the section [model]."""
        return dict(self.settings.get("model", {}))

    @property
    def estimates(self) -> dict[str, float]:
        """Return the parameters by name."""
        return {item.name: item.value for item in self.identified.found.parameters}

    @property
    def deviations(self) -> dict[str, float]:
        """Return their standard errors."""
        return {item.name: item.deviation for item in self.identified.found.parameters}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return the warnings."""
        return self.identified.warnings

    @property
    def refused(self) -> tuple[str, ...]:
        """Return why the data support no model; empty when they do."""
        return self.identified.found.refused

    def lines(self) -> list[str]:
        """Return the results and steps, for people."""
        one = self.identified
        found = one.found
        lag = "none" if not found.lag_s else f"{found.lag_s:.4g} s"
        lag += f" +- {found.lag_deviation_s:.2g} s, found" if found.lag_deviation_s else ""
        lines = [f"structure: {found.structure.kind}, {one.chosen.why}", f"motor lag: {lag}"]
        lines += [f"theta_0: {one.chosen.equilibrium}"] * bool(one.chosen.equilibrium)
        return [*lines, *(f"note: {text}" for text in (*self.source.notes, *one.notes))]

    def summary(self) -> dict[str, Any]:
        """Return the result for programs."""
        one = self.identified
        found = one.found
        check = None
        if found.check is not None:
            items = found.structure.parameters(found.check.values, found.check.covariance)
            check = {item.name: item.value for item in items}
        flown = None
        if self.flown is not None:
            flown = {
                "outcome": self.flown.outcome,
                "rate_bit_s": self.flown.rate_bit_s,
                "outputs": {
                    name: {"rms_error": rms, "largest_error": most, "largest": largest}
                    for name, rms, most, largest in self.flown.outputs
                },
            }
        return {
            "source": one.name,
            "structure": found.structure.kind,
            "estimates": self.estimates,
            "standard_errors": self.deviations,
            "motor_lag_s": found.lag_s,
            "motor_lag_standard_error_s": found.lag_deviation_s,
            "cross_check": check,
            "excitation": found.regression.condition,
            "filter_bandwidth_rad_s": found.regression.filters.bandwidth_rad_s,
            "equilibrium_source": one.chosen.equilibrium,
            "beside": self.beside,
            "notes": [*self.source.notes, *one.notes],
            "warnings": list(one.warnings),
            "not_supported": list(found.refused),
            "advice": one.advice,
            "config": None if self.config_file is None else str(self.config_file),
            "flown": flown,
        }


@dataclass(slots=True, eq=False)
class Result:
    """The results of all records of one command."""

    each: list[Each]
    base: FlightConfig
    simulated: bool

    @property
    def supported(self) -> bool:
        """Return whether every record supports a model that flies."""
        return all(one.settings for one in self.each)

    def save(self, folder: Path, *, fly: bool = True, draw: bool = True) -> None:
        """Write figures and configurations, and fly each record with its own."""
        if draw:
            from tenbaud.identification.figures import draw_estimates, draw_excitation

            found = [one.identified for one in self.each]
            draw_excitation(found, [folder / "figure-3.png", folder / "figure-3.svg"])
            true = true_values(self.base) if self.simulated else self.each[0].beside.get(TRUE)
            draw_estimates(found, [folder / "figure-4.png", folder / "figure-4.svg"], true)
        for index, one in enumerate(self.each):
            number = "" if index == 0 else f"-{index + 1}"
            if one.settings:
                _finish(one, folder, number, fly)


def _finish(one: Each, folder: Path, number: str, fly: bool) -> None:
    """Fly the record with the configured coder and with one fitted to it; write the better one."""
    readable = "file" in one.settings.get("flight_log", {})
    if one.source.bits is not None:
        # Without measurements there is nothing to fly over.
        fly = fly and readable
    elif not readable and not str(folder).isprintable():
        # No configuration can name a file there.
        fly = False
    elif not readable:
        log = written.write_record(folder / f"record{number}.csv", one.identified.record)
        one.settings["flight_log"] = log
    if fly:
        one.flown = fly_record(one.settings)
        # An experiment of this command shows the plant, not typical flights.
        if not one.source.excited and one.source.bits is None:
            fitted, note = with_coder(one.settings)
            flown = one.flown if note else fly_record(fitted)
            if flown.error < one.flown.error:
                one.settings, one.flown = fitted, flown
            notes = (*one.identified.notes, *filter(None, [note]))
            one.identified = replace(one.identified, notes=notes)
    one.config_file = folder / f"identified{number}.toml"
    said = one.flown.sentence() if one.flown is not None else ""
    written.write(one.config_file, one.settings, one.identified, said)


def sources_of(
    config: FlightConfig,
    source: Path | None,
    request: Request,
    excitation: Sequence[str] | None = None,
    duration_s: float | None = None,
) -> list[Source]:
    """Return the records: of the excited rig, of a run, or of a log."""
    if request.from_bits:
        unused = {
            "--bandwidth (bandwidth_rad_s)": request.bandwidth_rad_s is not None,
            "--damping": request.damping != Request().damping,
            "--forgetting": request.forgetting_per_s is not None,
            "--excitation": bool(excitation),
            "--duration": duration_s is not None,
        }
        named = [*sorted(request.given), *(name for name, given in unused.items() if given)]
        if source is None or named:
            leave = f" and leave out {', '.join(named)}" if named else ""
            raise IdentificationError(
                "--from-bits takes the folder of a run, and all settings from it: give the folder of a "
                f"run{leave}"
            )
        return [from_bits(source)]
    if source is None:
        rest = config.transmitter.plant.model_copy(
            update={"initial": getattr(config.model, "equilibrium_rad", 0.0)}
        )
        at_rest = config.model_copy(
            update={"transmitter": config.transmitter.model_copy(update={"plant": rest})}
        )
        signals = list(excitation or EXCITATIONS)
        return [
            Source(one, from_rig(at_rest, one, duration_s or DURATION_S), excited=True)
            for one in signals
        ]
    log = config.flight_log.model_copy(update={"file": str(source)})
    config = config.model_copy(update={"flight_log": log})
    # The tick of a preset that was not asked for says nothing about the file.
    tick_s = config.timing.tick_s if request.given & {"timing.tick_s", "preset"} else None
    record, notes = from_log(config, request.structure, tick_s)
    return [Source(source.name, record, notes, source)]


def identify_sources(config: FlightConfig, sources: Sequence[Source], request: Request) -> Result:
    """Identify every record, and work out the settings that fly it."""
    each = []
    for source in sources:
        if source.bits is not None:
            each.append(_from_bits(source, source.bits, request))
            continue
        record, dropped = with_commands(source.record)
        notes = [f"{name}: a set-point, which moves no plant: left out" for name in dropped]
        source = replace(source, record=record, dropped=dropped, notes=(*source.notes, *notes))
        one = run(source.name, record, _wanted(config, source, request))
        if isinstance(one.found.structure, PitchStructure):
            one = replace(one, record=_as_pitch(one.record, configured_signals(config)))
        settings = written.settings(config, one, source, request.given) if one.supported else {}
        if one.supported and not settings:
            slow = f"no flight: rows are {record.step_s:g} s apart, and ticks are at most 1 s"
            one = replace(one, warnings=(*one.warnings, slow))
        each.append(Each(one, source, settings))
    return Result(each, config, sources[0].excited)


def _from_bits(source: Source, bits: Bits, request: Request) -> Each:
    lag_s = None if request.lag == "auto" else _lag(request.lag)
    one = run_bits(source.name, bits, request.structure, request.equilibrium, lag_s)
    config, settings = bits.config, {}
    if one.supported:
        log = FlightLogSection(file="" if source.file is None else str(source.file))
        config = config.model_copy(update={"flight_log": log})
        settings = written.settings(config, one, source, SHARED)
    return Each(one, source, settings, beside=beside(bits, one.found, source.file))


def _as_pitch(record: Record, signals: Signals) -> Record:
    """Return a record whose signals have the names that the pitch model gives them."""
    outputs, inputs = signals.outputs[:1], signals.inputs[: record.inputs.shape[1]]
    return replace(
        record,
        output_names=tuple([one.name for one in outputs]),
        input_names=tuple([one.name for one in inputs]),
        output_units=tuple([unit or "rad" for unit in record.output_units]),
    )


def _wanted(config: FlightConfig, source: Source, request: Request) -> Wanted:
    excited = source.excited
    lag_s: float | None = None
    if request.lag != "auto":
        lag_s = _lag(request.lag)
    elif "model.motor_lag_s" in request.given or (excited and config.transmitter.rig == "simulated"):
        # The settings of a preset are for the preset's plant.
        lag_s = getattr(config.model, "motor_lag_s", None)
    bandwidth_rad_s, filters = request.bandwidth_rad_s, OF_A_LOG
    if excited:
        filters = Filters()
        bandwidth_rad_s = bandwidth_rad_s or filters.bandwidth_rad_s
    if request.forgetting_per_s is not None:
        filters = replace(filters, forgetting_per_s=request.forgetting_per_s)
    options = Options(lag_s, bandwidth_rad_s, replace(filters, damping=request.damping))
    limited = excited or "limits.command_max" in request.given
    volts_max = float("inf")
    own = tuple([one.name for one in configured_signals(config).outputs])
    pitches = config.model.kind == "pitch" and source.record.output_names == own
    if limited and pitches:
        volts_max = build_limits(config, configured_signals(config)).command_max[0]
    units = {f"flight_log.units.{one}" for one in ("input", "inputs", *source.record.input_names)}
    return Wanted(
        request.structure,
        request.equilibrium,
        volts_max,
        pitches,
        not units.isdisjoint(request.given),
        options,
    )


def _lag(text: str) -> float:
    with suppress(ValueError):
        if 0.0 <= (lag_s := float(text)) < math.inf:
            return lag_s
    raise IdentificationError(f"--lag {text}: give auto or seconds")


def identify(
    source: str | Path | Mapping[str, ArrayLike],
    *,
    outputs: Sequence[str] = (),
    inputs: Sequence[str] = (),
    tick_s: float | None = None,
    units: Mapping[str, str] | None = None,
    structure: str = "",
    lag: float | str = "auto",
    equilibrium: float | str = "auto",
    bandwidth_rad_s: float | None = None,
    preset: str | None = None,
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    fly: bool = True,
    from_bits: bool = False,
) -> Each:
    """Identify a plant from a file or from arrays, and return its model and its configuration.

    `source` is the path of a log or of a run folder, or a table of arrays by name, of which `outputs`
    and `inputs` name the signals and `tick_s` is the time between two rows. The other arguments are
    those of `tenbaud identify`: `structure`, `lag`, `equilibrium`, `bandwidth_rad_s`; with `from_bits`,
    only what crossed the wire of a run is used. `settings` are fields by their full names,
    `{"flight_log.columns": {"angle": "pitch_deg"}, ...}`.

    The result has `estimates`, `deviations`, `warnings`, `refused`, the section `model` and, where the
    data support a model, `config`. With `out`, a new folder, figures and `identified.toml` are written,
    and the record is flown with it. Raises IdentificationError and LogError for data of no use.
    """
    from tenbaud.recording.folder import create_run_folder

    path, over = None if config is None else Path(config), nested(settings or {})
    loaded = load_config(preset, path, over)
    given = frozenset(given_names(path, over) | ({"preset"} if preset else set()))
    request = Request(structure, str(lag), str(equilibrium), bandwidth_rad_s, fly=fly, given=given)
    request = replace(request, from_bits=from_bits)
    if isinstance(source, Mapping):
        if from_bits:
            raise IdentificationError(
                "from_bits takes the folder of a run, and arrays hold no symbols: give the folder, or "
                "leave out from_bits"
            )
        sources = [from_arrays(source, tuple(outputs), tuple(inputs), tick_s, units or {})]
    else:
        sources = sources_of(loaded, Path(source), request)
    result = identify_sources(loaded, sources, request)
    if out is not None:
        result.save(create_run_folder(None, "identify", Path(out)), fly=fly)
    return result.each[0]
