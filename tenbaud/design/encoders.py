"""The readers of the outputs, by the configuration's encoders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from channel.codec.signals import Signal, Signals
from plant_sim.encoder import Encoder, ExactReader, OutputReader
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import EncoderSection, EncodersSection
from tenbaud.log.units import turn_in

COUNTS_PER_TURN = 4096


def check_outputs(field: str, named: Mapping[str, Any], signals: Signals) -> None:
    """Raise ConfigError for a name that is not an output."""
    for name in named:
        if name not in [one.name for one in signals.outputs]:
            raise ConfigError(f"{field}.{name}: the plant's output(s) are {output_names(signals)}")


def output_names(signals: Signals) -> str:
    """Return the names of the outputs, for a text."""
    return ", ".join(one.name for one in signals.outputs)


def encoders_of(section: EncodersSection, signals: Signals) -> tuple[OutputReader, ...]:
    """Return the reader of each output."""
    field = "transmitter.encoders"
    check_outputs(field, section.by_name, signals)
    for one in signals.outputs:
        if (own := section.by_name.get(one.name)) is not None:
            _check_units(f"{field}.{one.name}", own, one)
    return tuple([_encoder(section.by_name.get(one.name, section), one) for one in signals.outputs])


def steps_of(section: EncodersSection, signals: Signals) -> list[float]:
    """Return the step of each output's reader, in the output's unit; 0 if it is read exactly."""
    return [one.step for one in encoders_of(section, signals)]


def _check_units(field: str, section: EncoderSection, output: Signal) -> None:
    if section.counts_per_turn is not None and turn_in(output.unit) is None:
        raise ConfigError(
            f"{field}.counts_per_turn = {section.counts_per_turn}: the output {output.name} is in "
            f"{output.unit}, which has no turns; give counts_per_unit"
        )
    if section.counts_per_turn is not None and section.counts_per_unit is not None:
        raise ConfigError(f"{field}: give counts_per_turn or counts_per_unit, not both")


def _encoder(section: EncoderSection, output: Signal) -> OutputReader:
    turn = turn_in(output.unit)
    counts: float = section.counts_per_turn or COUNTS_PER_TURN
    if section.counts_per_unit is not None:
        turn, counts = 1.0, section.counts_per_unit
    if turn is None or not section.quantised:
        return ExactReader()
    return Encoder(counts, section.sign, section.zero_counts, turn)
