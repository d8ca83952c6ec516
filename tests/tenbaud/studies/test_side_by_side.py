"""Flights side by side against single ones and ordinary ones, to the last bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from channel.numerics import ANGLE_RAD_MAX, sin
from tenbaud.config.load import load_config
from tenbaud.studies import side_by_side
from tenbaud.studies.compiled import compiled
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.lane_sine import lane_sine
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.side_by_side import LANES, can_share, fly_seeds, fly_side_by_side
from tests.tenbaud.studies.test_equal_bits import BAD_LINE, CLEAN, PRESETS, REAL_WIRE, config_of

NOISE = {"transmitter": {"plant": {"disturbance": "q=2e-3,step=0.5@3..5", "initial_angle_rad": 0.3}}}
SLOW_ECHO = {
    "channel": {"delivery": "end", "deadline_allowance_s": 0.03},
    "transmitter": {"plant": {"disturbance": "q=1e-2"}},
}


@pytest.mark.parametrize("changes", [CLEAN, NOISE, REAL_WIRE, SLOW_ECHO], ids=str)
@pytest.mark.parametrize("preset", PRESETS)
def test_when_flights_share_registers_then_no_bit_differs(preset: str, changes: dict[str, Any]) -> None:
    point = CompiledPoint(config_of(preset, changes))
    seeds = range(5, 14)
    figures, work = fly_side_by_side(point, seeds)
    for lane, seed in enumerate(seeds):
        single, trace = point.fly(seed)
        assert repr(figures[lane]) == repr(single)
        ticks = point.numbers.ticks
        assert work.models[:, lane].tobytes() == trace.models.tobytes()
        assert work.coders[:, lane].tobytes() == trace.coders.tobytes()
        assert work.coded[:ticks, lane].tobytes() == trace.coded[:ticks].tobytes()
        assert work.commanded[1:, 0, lane].tobytes() == trace.front.tobytes()
        assert work.commanded[1:, 1, lane].tobytes() == trace.rear.tobytes()


@pytest.mark.parametrize("preset", ["paper-10baud", "usual-1000baud"])
def test_when_flights_share_registers_then_each_is_an_ordinary_flight(preset: str) -> None:
    config = config_of(preset, NOISE)
    flown = fly_seeds(CompiledPoint(config), range(1, 8))
    assert len({figures.error_coded_rms for figures in flown if figures}) == 7
    for seed, figures in ((1, flown[0]), (7, flown[6])):
        plain = fly_plain(config.model_copy(update={"seed": seed}))
        assert figures is not None
        assert repr(figures._replace(engine="")) == repr(plain._replace(engine=""))


def test_when_a_lane_leaves_its_course_then_no_other_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    point = CompiledPoint(config_of("paper-10baud", NOISE))
    before, _ = fly_side_by_side(point, range(8))
    torque_of = side_by_side.torque_of

    def wild(config: Any, seed: int, ticks: int) -> Any:
        return torque_of(config, seed, ticks) * (1e9 if seed == 3 else 1.0)

    monkeypatch.setattr(side_by_side, "torque_of", wild)
    after, _ = fly_side_by_side(point, range(8))
    assert after[3] is None
    assert [repr(one) for one in after[:3] + after[4:]] == [
        repr(one) for one in before[:3] + before[4:]
    ]


def test_when_an_encoder_stands_still_then_no_lane_has_figures() -> None:
    # A quarter of a turn is one count: the model moves while the encoder does not.
    changes = {"transmitter": {"encoder_counts_per_turn": 4}, "duration_s": 20.0}
    point = CompiledPoint(load_config("paper-10baud", None, changes))
    assert fly_seeds(point, (1,)) == [None]
    assert fly_side_by_side(point, range(8))[0] == [None] * 8


def test_when_seeds_are_many_then_they_come_back_in_order() -> None:
    point = CompiledPoint(config_of("paper-10baud", NOISE))
    seeds = list(range(LANES + 9))
    assert [repr(one) for one in fly_seeds(point, seeds)] == [
        repr(point.fly(seed)[0]) for seed in seeds
    ]


def test_when_flights_are_long_then_fewer_share_registers(monkeypatch: pytest.MonkeyPatch) -> None:
    point = CompiledPoint(config_of("paper-10baud", NOISE))
    together: list[int] = []

    def counted(point: CompiledPoint, seeds: Any) -> Any:
        together.append(len(seeds))
        return fly_side_by_side(point, seeds)

    monkeypatch.setattr(side_by_side, "fly_side_by_side", counted)
    expected = fly_seeds(point, range(20))
    for ticks_max, sizes in ((point.numbers.ticks * 9, [8, 8, 4]), (point.numbers.ticks * 7, [])):
        together.clear()
        monkeypatch.setattr(side_by_side, "LANE_TICKS_MAX", ticks_max)
        assert fly_seeds(point, range(20)) == expected
        assert together == sizes


def test_when_the_line_has_faults_then_flights_are_flown_one_by_one() -> None:
    point = CompiledPoint(config_of("paper-10baud", BAD_LINE))
    assert not can_share(point)
    assert [repr(one) for one in fly_seeds(point, range(7))] == [
        repr(point.fly(seed)[0]) for seed in range(7)
    ]


def test_when_the_sine_has_no_branches_then_no_bit_differs() -> None:
    chance = np.random.default_rng(1)
    eighths = np.arange(-2000, 2001) * (math.pi / 4)
    angles = np.concatenate(
        [
            chance.uniform(-1.0, 1.0, 3000),
            chance.uniform(-10.0, 10.0, 3000),
            chance.uniform(-ANGLE_RAD_MAX, ANGLE_RAD_MAX, 3000),
            eighths,
            np.nextafter(eighths, -math.inf),
            np.nextafter(eighths, math.inf),
            [0.0, -0.0, 5e-324, -5e-324, ANGLE_RAD_MAX, -ANGLE_RAD_MAX],
        ]
    ).tolist()
    fast = compiled(lane_sine)
    assert [fast(angle).hex() for angle in angles] == [sin(angle).hex() for angle in angles]
    for angle in (1.0001 * ANGLE_RAD_MAX, -math.inf, math.nan):
        assert math.isnan(fast(angle))
