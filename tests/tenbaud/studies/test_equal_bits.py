"""Compiled flights against ordinary ones: every sample's digest, every figure, to the last bit."""

from __future__ import annotations

import copy
import csv
import math
import random
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from channel.codec.codec import CodecState
from channel.codec.numerics import sin
from channel.protocol.wire import DATAGRAM
from tenbaud import MemoryRecorder
from tenbaud.build.codec import build_codec
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.kinds import CODERS, MODELS
from tenbaud.config.load import load_config, preset_names
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.flight import transmit
from tenbaud.studies import compiled as compiling
from tenbaud.studies import machine_code
from tenbaud.studies.chunk import fly_point
from tenbaud.studies.compiled import arrays_of, compiled, whole_of
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.schedule import Uncommon
from tenbaud.studies.settings import StudyError, put
from tests.tenbaud.sum_of_states import SUM_OF_STATES
from tests.tenbaud.test_three_axes import CASCADE
from transmitter.session.records import SAMPLE_CHANNEL

PRESETS = ("paper-10baud", "tuned-20baud", "usual-1000baud", "linear")
"""Flown whole, compiled, under every line: three flights to compile."""
BY_PART = ("open-loop-zoom-10baud", "static-10baud", "history-10baud", "pendulum-30baud", "learning")
"""Their functions are compiled, which takes a third of the time; the long tests fly them whole."""
LINEAR = {
    **SUM_OF_STATES,
    "states": ["pitch", "pitch_rate", "drift"],
    "outputs": ["pitch", "sum"],
}
"""Two outputs, of which one is no state."""
LOOPS = {
    "receiver.pid.loops": [
        {"output": "pitch", "inputs": {"front": 1.0}, "proportional": 2.0, "derivative": 1.5},
        {"output": "sum", "inputs": {"rear": 1.0}, "integral": 0.1, "derivative": 0.2, "unit": "V/deg"},
    ],
    "receiver.reference.sum": {"kind": "step", "amplitude": 0.2},
}
"""One with the rate of a state, one with that of an output that has none."""

FLOOR = {"coder": {"floor_gain": 0.1, "floor_exponent": 0.4}}
"""The smallest range of the history coder follows its range."""

CLEAN: dict[str, Any] = {}
REAL_WIRE = {
    "channel": {"delivery": "end"},
    "timing": {"lead_ticks": 17},
    "transmitter": {
        "plant": {"mismatch": (0.1, -0.2, 0.15), "disturbance": "q=2e-3,step=0.5@3..5"},
        "encoders": {"sign": -1, "zero_counts": 77},
    },
    "limits": {"command_slew_per_s": 40.0, "initial_command": (0.4, -0.2)},
    "receiver": {"pid": {"normal_force_volts": 1.0}, "reference": {"kind": "sine", "period_s": 4.0}},
}
BAD_LINE = {
    "link": {"impairments": "up:loss=0.15,up:flip=0.05,down:loss=0.1,delay=60ms+-50ms,duplicate=0.05"},
    "channel": {"delivery": "end", "repeats": 12, "deadline_allowance_s": 0.03},
    "transmitter": {"plant": {"disturbance": "q=1e-2"}},
}
BURSTS = {
    "link": {"impairments": "up:burst=0.03/0.3,up:cut=4s+0.5s,down:loss=0.2,reorder=0.1/70ms"},
    "channel": {"repeats": 12},
}


def config_of(preset: str, changes: dict[str, Any]) -> FlightConfig:
    values = {**copy.deepcopy(changes), "duration_s": 8.0, "seed": 11}
    if preset == "pendulum-30baud" and "limits" in values:
        values["limits"]["initial_command"] = 0.04
        values["timing"]["lead_ticks"] = 25
    if preset.endswith("baud"):
        return load_config(preset, None, values)
    for name, value in LOOPS.items() if preset == "linear" else ():
        put(values, name, value)
    return load_config("paper-10baud", None, {**values, **designed(preset == "linear")})


@cache
def designed(linear: bool) -> dict[str, Any]:
    """Return model and coder."""
    return completed({"coder": {"kind": "direction"}, **({"model": LINEAR} if linear else {})})


def digests_of(config: FlightConfig) -> list[str]:
    """Return the digest of the transmitter's copy after each sample of an ordinary flight."""
    agreement = agree(config, "virtual")
    recorder = MemoryRecorder()
    run = transmit.prepare(agreement, recorder, DATAGRAM)
    transmit.fly_virtual(run, build_receiver(agreement, None, DATAGRAM), lambda: False)
    return [str(value) for value in recorder.column(SAMPLE_CHANNEL.topic, "digest")]


@pytest.fixture
def uncached(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], None]]:
    """Return what makes everything compile anew."""
    remembered = (compiling.compiled, compiling.reader, compiling.whole_of, compiling.states_read)

    def forget() -> None:
        monkeypatch.setattr(machine_code, "cache_folder", lambda: None)
        for one in remembered:
            one.cache_clear()

    yield forget
    if machine_code.cache_folder() is None:
        for one in remembered:
            one.cache_clear()


def test_when_the_machine_code_is_read_then_nothing_is_fused(uncached: Callable[[], None]) -> None:
    # Of a tick of the model, which is compiled as the flight is, and is much smaller.
    uncached()  # numba does not show machine code that it has read from a file
    codec = build_codec(config_of("paper-10baud", CLEAN))
    model: Any = codec.model
    tick = compiling.compiled(model.tick_function)
    assert tick(model.initial(), (0.1, 0.2), codec.nothing_held, model.constants) == model.tick(
        model.initial(), (0.1, 0.2), codec.nothing_held
    )
    code = "\n".join(tick.inspect_asm().values())
    assert re.search(r"\bv?mul[sp]d\b", code), "this is not the machine code of a tick"
    assert re.search(r"\bv?f(n)?m(add|sub)", code) is None


@pytest.mark.parametrize("changes", [CLEAN, REAL_WIRE, BAD_LINE, BURSTS], ids=str)
@pytest.mark.parametrize(
    "preset", [*PRESETS, *(pytest.param(one, marks=pytest.mark.soak) for one in BY_PART[:-1])]
)
def test_when_a_flight_is_compiled_then_no_bit_differs(preset: str, changes: dict[str, Any]) -> None:
    config = config_of(preset, changes)
    point = CompiledPoint(config)
    if preset == "pendulum-30baud" and changes is BURSTS:
        with pytest.raises(Uncommon, match="guard steps in"):
            point.fly(config.seed)
        return
    if preset == "usual-1000baud" and changes is BAD_LINE:
        # No word of ten symbols comes whole: the nodes fly it, and what comes of that is the result.
        with pytest.raises(Uncommon, match="flown"):
            point.fly(config.seed)
        figures = fly_plain(config)
        assert (figures.outcome, figures.erasures) == ("ok", figures.samples)
        return
    compare(point)


@pytest.mark.parametrize(
    "preset",
    # Those of `history` are compared in `tests/channel/codec/coders/test_history.py`.
    [pytest.param(one, marks=pytest.mark.soak if one == "history-10baud" else ()) for one in BY_PART],
)
def test_when_the_functions_of_a_codec_are_compiled_then_no_bit_differs(preset: str) -> None:
    learns = preset == "learning"
    changes = learning() if learns else FLOOR if preset == "history-10baud" else {}
    config = load_config("integrator-10baud" if learns else preset, None, changes)
    codec = build_codec(config)
    chooser = random.Random(7)
    model: Any = codec.model
    coder: Any = codec.coder
    constants, size = arrays_of(coder.constants), coder.alphabet.symbols_per_word
    encode, decode, allocates = coder.functions
    encode, decode = compiled(encode, allocates=allocates), compiled(decode, allocates=allocates)
    row = getattr(model, "row_function", None)
    tick = whole_of(row) if row else compiled(model.tick_function)
    state = codec.initial()
    for sample in range(60):
        predicted = codec.predicted(state)
        measured = tuple(value + chooser.uniform(-0.2, 0.2) for value in predicted)
        symbols = np.zeros(size, dtype=np.int64)
        encode(constants, np.array(state.coder), np.array(predicted), np.array(measured), symbols)
        sent = codec.encode(state, measured)
        assert tuple(symbols.tolist()) == sent
        word = None if sample % 7 == 3 else sent
        correction, after = np.empty(model.correction_size), np.empty(len(state.coder))
        read = np.array(word or (0,) * size)
        erased = word is None
        decode(constants, np.array(state.coder), np.array(state.model), read, erased, correction, after)
        moved, following = coder.decode(state.coder, state.model, word)
        assert (tuple(correction.tolist()), tuple(after.tolist())) == (moved, following)
        opened = codec.open(state, word)
        command = (chooser.uniform(-1.0, 1.0),) * model.input_size
        ticked = tick(opened.model, command, opened.held, arrays_of(model.constants))
        assert ticked == model.tick(opened.model, command, opened.held)
        state = codec.step(state, word, [command] * codec.ticks_per_sample)
    assert not learns or np.abs(state.model[2:4]).max() > 0.0
    assert changes is not FLOOR or state.coder[2] > 0.1


@pytest.mark.soak
def test_when_the_codec_learns_its_plant_then_no_bit_differs() -> None:
    values = {
        **BURSTS,
        "duration_s": 8.0,
        "transmitter": {"plant": {"mismatch": 0.1, "disturbance": "q=2e-3"}},
    }
    point = CompiledPoint(load_config("integrator-10baud", None, {**values, **learning()}))
    compare(point)
    assert np.abs(point._work.models[-1, 2:4]).max() > 0.01  # the errors of its terms


@cache
def learning() -> dict[str, Any]:
    """Return a model that learns, and its coder."""
    given = load_config("integrator-10baud").model_dump(mode="json", exclude_unset=True)
    model = {**given["model"], "learns": True}
    return completed({"model": model, "coder": {"kind": "learning"}})


@pytest.mark.soak
def test_when_the_smallest_range_follows_the_range_then_no_bit_differs() -> None:
    point = CompiledPoint(config_of("history-10baud", {**REAL_WIRE, **FLOOR}))
    compare(point)
    assert point._work.coders[-1, 2] > 0.1


COMPILED_LONG = (
    *("integrator-10baud", "heading-1baud", "servo-10baud", "aero-20baud"),
    *("helicopter-10baud", "furuta-50baud", "direction"),
)
"""Few samples each, but machine code of its own for every number of states, inputs and outputs.

`direction` is the coder of `linear` on the plant of the other presets."""


@pytest.mark.soak
def test_when_loops_steer_each_other_then_no_bit_differs() -> None:
    # Travel asks for more than its set-point of the pitch may be, so that its integral rests.
    elevation, travel, pitch = CASCADE["pid"]["loops"]
    loops = [elevation, {**travel, "integral": 0.5, "set_point_max": 0.1}, pitch]
    receiver = {**CASCADE, "pid": {**CASCADE["pid"], "loops": loops}}
    compare(CompiledPoint(config_of("helicopter-10baud", {"receiver": receiver})))


@pytest.mark.soak
@pytest.mark.parametrize("preset", COMPILED_LONG)
def test_when_any_other_plant_is_compiled_then_no_bit_differs(preset: str) -> None:
    compare(CompiledPoint(config_of(preset, CLEAN)))


@pytest.mark.parametrize("preset", [name for name in preset_names() if not name.startswith("uiuc")])
def test_when_a_preset_has_a_simulated_plant_then_studies_can_compile_it(preset: str) -> None:
    # Nothing is compiled before it is flown. The presets of a rig's recordings have no such plant.
    CompiledPoint(load_config(preset))


def compare(point: CompiledPoint) -> None:
    """Fly a point compiled and by the nodes; no digest and no figure may differ."""
    config = point.config
    figures, trace = point.fly(config.seed)
    plain = fly_plain(config)
    assert repr(figures._replace(engine="")) == repr(plain._replace(engine=""))
    assert len(figures.outputs) == len(point.agreement.signals.outputs)
    codec = point.agreement.codec
    expected = digests_of(config)
    ours = [
        f"{codec.digest(CodecState(index + 1, tuple(model), tuple(coder))):016x}"
        for index, (model, coder) in enumerate(
            zip(trace.models[1:].tolist(), trace.coders[1:].tolist(), strict=True)
        )
    ]
    # Echoes may still be missing at the end, and erasures that belong to no flight may come after it.
    common = min(len(ours), len(expected))
    assert common > 0.9 * len(ours)
    assert ours[:common] == expected[:common]


def test_when_a_kind_of_model_or_coder_exists_then_a_preset_above_flies_it() -> None:
    flown = (*PRESETS, *BY_PART[:-1], *COMPILED_LONG, "fixed-10baud")
    configs = [config_of(preset, {}) for preset in flown]
    assert {config.coder.kind for config in configs} == set(CODERS.built_in)
    assert {config.model.kind for config in configs} == set(MODELS.built_in)


def test_when_a_flight_cannot_be_compiled_then_the_nodes_fly_it_and_it_says_why() -> None:
    config = config_of("paper-10baud", {"transmitter": {"dry_run": True}})
    (figures,) = fly_point(config, [1], "auto")
    assert (figures.engine, figures.not_compiled) == ("plain", "sabotage and dry runs")
    with pytest.raises(StudyError, match="cannot fly sabotage and dry runs"):
        fly_point(config, [1], "compiled")
    compact = config_of("paper-10baud", {"channel": {"downlink": "compact"}})
    with pytest.raises(StudyError, match="cannot fly the compact downlink"):
        fly_point(compact, [1], "compiled")


def test_when_a_recorded_flight_is_compiled_then_no_figure_differs(tmp_path: Path) -> None:
    log = tmp_path / "flight.csv"
    with log.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("step", "pitch_counts", "right_volts", "left_volts"))
        for step in range(333):
            volts = 1.5 * math.sin(0.03 * step)
            writer.writerow((step, round(300 * math.sin(0.02 * step)), volts, -volts))
    changes = {
        "transmitter": {"rig": "replay"},
        "receiver": {"controller": "recorded"},
        "flight_log": {"file": str(log)},
    }
    # With the coder that `identify` fits to a record: its tests need not compile another flight.
    coder = load_config("history-10baud").coder.model_dump(mode="json")
    config = load_config("uiuc-10baud", None, {**changes, "coder": coder, "duration_s": 100.0})
    figures, _ = CompiledPoint(config).fly(1)
    plain = fly_plain(config)
    assert repr(figures._replace(engine="")) == repr(plain._replace(engine=""))
    assert figures.first.error_live_rms > 0.0
    assert math.isnan(figures.first.tracking_rms)


@pytest.mark.parametrize(
    "changes",
    [
        {"transmitter": {"soft_limits": 0.5}},
        {"coder": {"gains": (4000.0, 9e7)}},
        {"link": {"impairments": "up:dead=1s"}},
        {"link": {"impairments": "raw=0.01"}},
        {"transmitter": {"sabotage": "sample=9,field=range"}},
        {"transmitter": {"plant": {"kind": "outside:Cart"}}},
    ],
    ids=str,
)
def test_when_a_flight_leaves_its_course_then_the_compiled_one_says_so(changes: dict[str, Any]) -> None:
    config = config_of("paper-10baud", changes)
    with pytest.raises(Uncommon):
        CompiledPoint(config).fly(config.seed)


def test_when_an_angle_is_beyond_all_sense_then_the_compiled_sine_refuses_it_too() -> None:
    assert compiled(sin)(1.25).hex() == sin(1.25).hex()
    with pytest.raises(ValueError, match="out of range"):
        compiled(sin)(2e5)
