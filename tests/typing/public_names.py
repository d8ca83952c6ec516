"""What a type checker knows of the public names. Never run: `make check` reads it.

Each `type: ignore` stands at an error that must be found: one that is not needed fails the check too.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

from tenbaud import (
    Codec,
    FlightResult,
    MemoryFlight,
    Preset,
    ReceiverSession,
    Run,
    Terms,
    TransmitterSession,
    coders,
    controllers,
    errors,
    fly,
    load_preset,
    models,
    plants,
    preset_names,
)

TICK_S = 0.01
Series = NDArray[np.float64]


def signals_of(run: Run) -> None:
    assert_type(run.pitch, Series)
    assert_type(run.symbol, Series)
    assert_type(run.gap_to_floor, Series)
    assert_type(run.time_s, Series)
    # What a plant calls its outputs and inputs is known only when the run is read.
    assert_type(run.angle, Series)


def parts() -> MemoryFlight:
    model = models.PitchModel(models.PitchParameters(), TICK_S)
    codec = Codec(model, coders.ZoomCoder(coders.ZoomParameters()), ticks_per_sample=10)
    plant = plants.PitchPlant(plants.PitchParameters(), TICK_S)
    reference = controllers.Sine(1.0, 20.0, TICK_S)
    controller = controllers.Pid(controllers.PAPER_GAINS, reference, TICK_S)
    terms = Terms.for_codec(codec, TICK_S, delivery="end")
    assert_type(terms, Terms)
    Terms.for_codec(codec, TICK_S, delivery="middle")  # type: ignore[arg-type]
    MemoryFlight(codec, terms, controller, plant)  # type: ignore[arg-type]
    return MemoryFlight(codec, terms, plant, controller)


def result_of(flight: MemoryFlight) -> None:
    result = flight.fly(20.0)
    assert_type(result, FlightResult)
    assert_type(result.errors, Series)
    assert_type(result.words, tuple[coders.Word, ...])
    assert_type(result.counts, Mapping[str, Mapping[str, int]])
    assert_type(flight.transmitter, TransmitterSession)
    assert_type(flight.receiver, ReceiverSession)


def flights(plant: plants.Plant) -> None:
    assert_type(fly("tuned-10baud", plant=plant, controller="mine:Law"), Run)
    fly("tuned-10baud", plant=3.0)  # type: ignore[arg-type]
    assert_type(preset_names(), list[str])
    assert_type(load_preset("tuned-10baud"), Preset)
    assert_type(load_preset("tuned-10baud").codec, Codec)
    try:
        fly("tuned-10baud", link="carrier-pigeon")
    except errors.ConfigError as error:
        assert_type(error, errors.ConfigError)
