from __future__ import annotations

import math

import numpy as np
import pytest

from channel.flight_log import FlightLog
from plant_sim.encoder import QUANSER_PITCH, Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from transmitter.rigs.emulator.device import EmulatedDevice, RecordedBody, SimulatedBody
from transmitter.rigs.emulator.faults import Faults
from transmitter.rigs.formats.samples import DeviceFlag

MS = 1_000_000
S = 1_000 * MS


def device(*faults: str) -> EmulatedDevice:
    body = SimulatedBody(PitchPlant(PitchParameters(), 0.001), MS, {1: QUANSER_PITCH})
    return EmulatedDevice(body, 0, 0.1, Faults(faults))


def flown(one: EmulatedDevice, until_ms: int, start_ms: int = 0, volts: float = 2.0) -> EmulatedDevice:
    for now_ms in range(start_ms, until_ms, 10):
        one.command(now_ms * MS, (volts, -volts), True)
    return one


def test_the_body_rests_until_the_motors_are_enabled_and_then_moves_as_the_plant() -> None:
    one = device()
    assert one.sample(5 * S).counts == (0, 0, 0)
    one.command(5 * S, (2.0, -2.0), True)
    plant = PitchPlant(PitchParameters(), 0.001)
    for now_ms in range(10, 500, 10):
        one.command(5 * S + now_ms * MS, (2.0, -2.0), True)
    for _ in range(490):
        plant.advance((2.0, -2.0))
    assert one.sample(5 * S + 490 * MS).counts[1] == QUANSER_PITCH.counts(plant.angle_rad)


def test_the_watchdog_cuts_and_stays_cut_until_disarmed() -> None:
    one = flown(device(), 500)
    one.advance(589 * MS)
    assert one.enabled
    one.advance(592 * MS)
    assert (one.enabled, one.volts, one.tripped) == (False, (0.0, 0.0), True)
    one.command(600 * MS, (2.0, 2.0), True)
    assert not one.enabled
    assert one.sample(600 * MS).flags == DeviceFlag.WATCHDOG_TRIPPED | DeviceFlag.EMULATED
    one.command(610 * MS, (0.0, 0.0), False)
    one.command(620 * MS, (2.0, 2.0), True)
    assert one.enabled
    assert one.counts["watchdog_trips"] == 1


def test_a_late_look_does_not_lengthen_the_voltage() -> None:
    looked_at, left_alone = flown(device(), 500), flown(device(), 500)
    for now_ms in range(500, 3000):
        looked_at.advance(now_ms * MS)
    assert looked_at.sample(3 * S).counts == left_alone.sample(3 * S).counts


def test_faults_happen_when_they_should() -> None:
    one = flown(device("stuck@0.2..0.4", "estop@0.6"), 200)
    stuck = one.sample(200 * MS).counts
    assert flown(one, 400, 200).sample(399 * MS).counts == stuck
    assert one.sample(401 * MS).counts != stuck
    flown(one, 600, 400)
    one.command(610 * MS, (2.0, 2.0), True)
    assert not one.enabled
    assert one.sample(610 * MS).flags & DeviceFlag.ESTOP_OPEN


def test_a_reset_starts_counts_and_clock_anew() -> None:
    one = flown(device("reset@0.3"), 300)
    before = one.sample(299 * MS)
    after = one.sample(301 * MS)
    assert before.counts[1] > 10
    assert (after.counts[1], after.sequence) == (0, 1)
    assert after.device_us is not None
    assert after.device_us < 1000


def test_a_jump_shifts_the_counts_for_good() -> None:
    one, other = flown(device("jump=400@0.3"), 310), flown(device(), 310)
    one.sample(305 * MS)
    assert one.sample(310 * MS).counts[1] - other.sample(310 * MS).counts[1] == 400


def test_a_recorded_flight_comes_again_and_stays_at_its_end() -> None:
    angles = np.array([[5.0], [6.0], [7.0]]) * math.tau / 4096.0
    log = FlightLog(0.01, angles, np.empty((3, 0)), np.zeros((3, 1), np.int64))
    one = EmulatedDevice(RecordedBody(log, 10 * MS, {1: Encoder(4096)}), 0, 0.1)
    one.command(S, (1.0, 1.0), True)
    read = [one.sample(S + ms * MS).counts[1] for ms in (0, 9, 10, 20, 500)]
    assert read == [5, 5, 6, 7, 7]


@pytest.mark.parametrize(
    "text", ["", "stuck", "stuck@", "stuck@5..4", "drop=2", "drop=0.1@3", "fire@1"]
)
def test_an_unknown_fault_shows_the_grammar(text: str) -> None:
    with pytest.raises(ValueError, match="stuck@START"):
        Faults((text,))


def test_dropped_bytes_are_about_the_share_asked_for() -> None:
    left = len(Faults(("drop=0.1",), seed=3).thin(bytes(10_000)))
    assert 8_700 < left < 9_300
