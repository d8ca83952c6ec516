"""The gap gauge: it finds the push that is there, none where there is none, and the known ratios."""

from __future__ import annotations

from typing import Any

import pytest

from channel.protocol.wire import DATAGRAM
from tenbaud import MemoryRecorder
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.design.complete import completed
from tenbaud.design.described import plant_section
from tenbaud.flight import transmit
from tenbaud.flight.summary import transmitter_part
from transmitter.metrics.gap import GAP_CHANNEL, MEMORY_S, GapGauge, Limit, Running, StrengthMeter


def fly(preset: str, seconds: float = 60.0, **changed: Any) -> tuple[dict[str, Any], MemoryRecorder]:
    """Fly in memory; return the transmitter's summary and what it recorded."""
    agreement = agree(load_config(preset, None, {"duration_s": seconds, **changed}), "virtual")
    recorder = MemoryRecorder()
    run = transmit.prepare(agreement, recorder, DATAGRAM)
    outcome = transmit.fly_virtual(run, build_receiver(agreement, None, DATAGRAM), lambda: False)
    return transmitter_part(run, outcome), recorder


def pushed(density: float, mismatch: float = 0.0, seed: int = 3) -> dict[str, Any]:
    plant = {"mismatch": mismatch, "disturbance": f"q={density}"}
    return {"transmitter": {"plant": plant}, "seed": seed}


@pytest.mark.parametrize(
    ("preset", "density"), [("tuned-10baud", 2e-4), ("paper-10baud", 2e-3), ("tuned-10baud", 2e-2)]
)
def test_when_the_plant_is_pushed_then_the_density_is_found(preset: str, density: float) -> None:
    # A minute is some 60 spans that do not overlap: 18 % is one deviation.
    summary, _ = fly(preset, **pushed(density, seed=1))
    assert summary["disturbance_density"] == pytest.approx(density, rel=0.35)


@pytest.mark.parametrize(
    ("plant", "rate"),
    [pytest.param("helicopter", 33, marks=pytest.mark.soak), ("furuta", 50), ("heading", 5)],
)
def test_any_linear_plant_has_its_density_found_and_its_error_over_the_floor(
    plant: str, rate: int
) -> None:
    model = plant_section(plant).model_dump(exclude_unset=True)
    timing = {"timing": {"symbol_period_s": -(-100 // rate) / 100}, "channel": {"rate_baud": rate}}
    changed = completed({**timing, "model": model, "coder": {"kind": "direction"}})
    density = model["densities"][0]
    summary, recorder = fly(
        "paper-10baud",
        **changed,
        receiver={"controller": "state_feedback", "reference": {"kind": "constant", "amplitude": 0.0}},
        limits={"command_max": 20.0},
        transmitter={"plant": {"disturbance": f"q={density}"}},
        seed=2,
    )
    assert summary["disturbance_density"] == pytest.approx(density, rel=0.35)
    # Measured: helicopter 1.8 to 2.1; heading, where a step of the encoder is six times the floor, 3.4;
    # furuta, which needs half of its rate, 2.8 to 3.5 with 15 seeds of 16. With the other one, seed 1,
    # its error grew to 0.1 rad once before the coder caught it, and the ratio is 5.9. There is no lead,
    # so the live error is the coded one.
    assert summary["lead_ticks"] == 0
    assert 1.4 < summary["rms_over_floor"] < 4.0
    assert recorder.column("gap", "rms_over_floor")[-1] == pytest.approx(
        summary["rms_over_floor"], rel=0.5
    )
    paid = rate * (summary["duration_s"] - summary["window_start_s"])
    assert 0.1 * paid < summary["ideal_bits"] < paid


def test_when_nothing_pushes_then_there_is_nothing_to_compare() -> None:
    summary, recorder = fly("paper-10baud", 20.0, transmitter={"plant": {"mismatch": 0.0}})
    assert summary["disturbance_density"] is None
    assert summary["rms_over_floor"] is None
    rows = recorder.column("gap", "rms_over_floor")
    assert len(rows) == 20
    assert set(rows) == {None}


def test_when_it_is_pushed_then_the_gauge_is_the_error_over_the_floor() -> None:
    summary, recorder = fly("tuned-10baud", **pushed(2e-2))
    floor_rad = (0.8897 * summary["disturbance_density"] / 10.0**3) ** 0.5
    assert summary["rms_over_floor"] == pytest.approx(
        summary["error_live_rms_rad"] / floor_rad, rel=1e-3
    )
    # R^-1.5: what an ideal code needs for this error, of the 10 bit/s that were paid in the window.
    paid = 10.0 * (summary["duration_s"] - summary["window_start_s"])
    assert summary["ideal_bits"] == pytest.approx(
        paid * summary["rms_over_floor"] ** (-2 / 3), rel=1e-3
    )
    assert 1.0 < recorder.column("gap", "rms_over_floor")[-1] < 5.0


def test_when_a_flight_rejoins_then_the_estimate_is_not_thrown_off() -> None:
    changed = pushed(2e-3)
    changed["transmitter"]["sabotage"] = "sample=300,field=angle"
    summary, _ = fly("tuned-10baud", **changed)
    assert summary["rejoins"] == 1
    assert summary["disturbance_density"] == pytest.approx(2e-3, rel=0.5)


def test_when_the_model_predicts_nothing_then_there_is_no_gauge() -> None:
    summary, recorder = fly("usual-1000baud", seconds=1.5)
    assert summary["rms_over_floor"] is None
    assert not recorder.column(GAP_CHANNEL.topic, "sample")


def test_when_nothing_has_pushed_at_all_then_there_is_no_gauge() -> None:
    limit = Limit(1.0, lambda per_density: per_density, (1.0,))
    codec = agree(load_config("tuned-10baud", None, {}), "virtual").codec
    still = StrengthMeter(codec, 0.01, angle_step_rad=0.0)
    still.squares.add(0.0)
    assert still.value == 0.0
    gauge = GapGauge(limit, still, codec.ticks_per_sample, 0.01)
    gauge.on_errors((0.1,))
    assert gauge.now is None


def test_a_running_mean_forgets_and_the_whole_does_not() -> None:
    running = Running(period_s=1.0)
    assert running.recent is None
    for _ in range(100):
        running.add(0.0)
    for _ in range(int(MEMORY_S)):
        running.add(1.0)
    assert running.whole == pytest.approx(20.0 / 120.0)
    assert running.recent == pytest.approx(1.0 - 0.95**20)
