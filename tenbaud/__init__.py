"""Fly a helicopter over a ten-baud wire.

Two processes estimate and control a plant over 10 bit/s: they run the same codec and are checked to be
in lockstep, sample by sample. In Python, the same flight is put together from objects:

    from tenbaud import Codec, MemoryFlight, Terms, coders, controllers, models, plants

    TICK_S = 0.01
    model = models.PitchModel(models.PitchParameters(), TICK_S)
    codec = Codec(model, coders.ZoomCoder(coders.ZoomParameters(window=3)), ticks_per_sample=10)
    plant = plants.PitchPlant(plants.PitchParameters().mismatched(0.1), TICK_S)
    reference = controllers.Square(1.57, 25.0, TICK_S)
    controller = controllers.Pid(controllers.PAPER_GAINS, reference, TICK_S)
    result = MemoryFlight(codec, Terms.for_codec(codec, TICK_S), plant, controller).fly(20.0)
    print(result, abs(result.errors).max())

What both ends share
    Codec               coder plus observer: one state machine, equal copies at both ends
    Terms               the timing of a flight: ticks, samples, lead, delivery
    coders, models      what plugs into a codec, and the protocols for your own

What is flown, and how it is steered
    plants              simulated plants, and the protocol for your own
    controllers         controllers, the set-points they follow, and the protocol for your own

Flights
    MemoryFlight        both ends in this process, from objects, on the virtual clock
    FlightResult        what it returns: times, states, words, errors, counts
    MemoryRecorder      keeps the rows that an end records
    TransmitterSession  the sensor node's half of the protocol, without socket, clock or thread
    ReceiverSession     the controller node's half

Configured flights and their recordings
    identify            a model, and a configuration that flies it, from a log or arrays
    fly                 flies a preset, a configuration or objects; leaves a run folder
    Run                 reads a run: its signals as numpy arrays on one time base, its figures
    compare             the figures of several runs side by side, and their curves
    Preset              the parts of a preset, from load_preset
    load_preset         a preset as objects
    preset_names        the presets that there are

    errors              everything that is raised on purpose

Everything is loaded when it is first used, so that `import tenbaud` and the command line stay quick.
docs/reference/python.md has an example of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from channel.codec.codec import Codec as Codec
    from channel.protocol.terms import Terms as Terms
    from receiver.session.session import ReceiverSession as ReceiverSession
    from tenbaud import coders as coders
    from tenbaud import controllers as controllers
    from tenbaud import errors as errors
    from tenbaud import models as models
    from tenbaud import plants as plants
    from tenbaud.build.preset import Preset as Preset
    from tenbaud.build.preset import load_preset as load_preset
    from tenbaud.config.load import preset_names as preset_names
    from tenbaud.flight.fly import fly as fly
    from tenbaud.flight.memory import MemoryFlight as MemoryFlight
    from tenbaud.flight.memory_result import FlightResult as FlightResult
    from tenbaud.identification.api import identify as identify
    from tenbaud.recording.memory import MemoryRecorder as MemoryRecorder
    from tenbaud.recording.run import Run as Run
    from tenbaud.recording.side_by_side import compare as compare
    from transmitter.session.session import TransmitterSession as TransmitterSession

_HOMES = {
    "Codec": "channel.codec.codec",
    "FlightResult": "tenbaud.flight.memory_result",
    "MemoryFlight": "tenbaud.flight.memory",
    "MemoryRecorder": "tenbaud.recording.memory",
    "Preset": "tenbaud.build.preset",
    "ReceiverSession": "receiver.session.session",
    "Run": "tenbaud.recording.run",
    "Terms": "channel.protocol.terms",
    "TransmitterSession": "transmitter.session.session",
    "compare": "tenbaud.recording.side_by_side",
    "fly": "tenbaud.flight.fly",
    "identify": "tenbaud.identification.api",
    "load_preset": "tenbaud.build.preset",
    "preset_names": "tenbaud.config.load",
}
"""The module of each name."""
__all__ = [*_HOMES, "coders", "controllers", "errors", "models", "plants"]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in __all__:
        return import_module(f"tenbaud.{name}")
    raise AttributeError(f"module 'tenbaud' has no attribute {name!r}; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
