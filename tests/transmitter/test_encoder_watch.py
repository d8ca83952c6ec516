"""A stuck encoder is found; a body that stands still is not taken for one."""

from __future__ import annotations

import math

from channel.codec.codec import Codec, ModelContext, Vector
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.pendulum import PendulumModel
from plant_sim.encoder import QUANSER_PITCH
from plant_sim.pitch import PitchParameters, PitchPlant
from tests.channel.codec.parts import TICK_S, pitch_codec
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes
from transmitter.encoder_watch import EncoderWatch, window_ticks

CODEC = pitch_codec()
REST: Vector = (-0.115, 0.0, 0.0, 0.0)


def first_fault(watch: EncoderWatch, ticks: int, volts: Vector, estimate: Vector) -> int | None:
    for tick in range(ticks):
        if watch.check((12,), volts, estimate) is not None:
            return tick
    return None


def test_when_full_voltage_moves_nothing_then_the_encoder_is_stuck_after_one_window() -> None:
    assert first_fault(EncoderWatch(CODEC, TICK_S), 300, (5.0, -5.0), REST) in range(98, 102)


def test_when_an_encoder_is_stuck_then_the_fault_says_where_and_how_far_the_body_should_be() -> None:
    watch = EncoderWatch(CODEC, TICK_S)
    faults = [watch.check((12,), (5.0, -5.0), REST) for _ in range(102)]
    (fault,) = [fault for fault in faults if fault is not None]
    assert "the encoder of pitch stood at 12 counts for 10" in fault
    assert "moved by 1.4" in fault


def test_when_the_body_rests_at_its_equilibrium_then_nothing_is_flagged() -> None:
    assert first_fault(EncoderWatch(CODEC, TICK_S), 5000, (0.0, 0.0), REST) is None


def test_when_the_body_is_held_at_a_set_point_then_nothing_is_flagged() -> None:
    # k_v mu = a_th sin(theta - theta_0) holds the body at 1.2 rad; the model agrees that it rests.
    mu = 0.5 * math.sin(1.2 + 0.115) / 0.35
    estimate = (1.2, 0.0, mu / 2, -mu / 2)
    assert first_fault(EncoderWatch(CODEC, TICK_S), 5000, (mu / 2, -mu / 2), estimate) is None


def test_when_the_estimate_of_a_settled_body_is_a_little_off_then_nothing_is_flagged() -> None:
    estimate = (0.1, 0.2, 0.3, -0.2)
    assert first_fault(EncoderWatch(CODEC, TICK_S), 5000, (0.1, -0.1), estimate) is None


def test_when_the_real_body_flies_then_nothing_is_flagged_whatever_it_does() -> None:
    plant = PitchPlant(PitchParameters().mismatched(0.1), TICK_S)
    watch = EncoderWatch(CODEC, TICK_S)
    for tick in range(10_000):
        push = 3.0 if tick // 250 % 2 else -3.0
        counts = (QUANSER_PITCH.counts(plant.measured[0]),)
        assert watch.check(counts, (push, -push), plant.state) is None
        plant.advance((push, -push))


def test_when_the_encoder_sticks_in_flight_then_it_is_found_within_two_windows() -> None:
    plant = PitchPlant(PitchParameters(), TICK_S)
    watch = EncoderWatch(CODEC, TICK_S)
    found = None
    for tick in range(1000):
        push = 4.0 if tick // 150 % 2 else -4.0
        seen = plant.measured[0] if tick < 400 else 0.3
        counts = (QUANSER_PITCH.counts(seen),)
        if watch.check(counts, (push, -push), plant.state) is not None:
            found = tick
            break
        plant.advance((push, -push))
    assert found is not None
    assert 400 < found <= 600


def test_when_one_of_two_encoders_sticks_then_that_axis_is_named() -> None:
    codec = Codec(TwoAxes(TICK_S), ZoomCoder(TWO_AXES_ZOOM), 4)
    watch = EncoderWatch(codec, TICK_S)
    faults = [watch.check((tick, 7), (3.0, 3.0), (0.0, 0.0, 0.0, 0.0)) for tick in range(102)]
    assert faults[:98] == [None] * 98
    (fault,) = [fault for fault in faults if fault is not None]
    assert "output_2 stood at 7 counts" in fault


def test_an_unstable_plant_is_watched_for_as_long_as_its_estimate_can_be_relied_on() -> None:
    context = ModelContext(TICK_S, 0.1)
    pendulum = Codec(PendulumModel(context), ZoomCoder(ZoomParameters()), 10)
    assert window_ticks(CODEC.model, TICK_S) == 100
    assert 20 <= window_ticks(pendulum.model, TICK_S) <= 40
    watch = EncoderWatch(pendulum, TICK_S)
    # Upright and at rest, an estimate off by a hundredth of a radian falls over within a second.
    assert all(watch.check((0,), (0.0,), (0.01, 0.0)) is None for _ in range(1000))
