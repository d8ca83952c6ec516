"""The HIL rig with the double of the vendor's class."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

from tenbaud.build.rig import build_device
from tests.transmitter.rigs.emulated import PATIENCE_S, fly, rig_config, wait_until
from transmitter.rigs.base import RigError
from transmitter.rigs.device import DeviceRig
from transmitter.rigs.fake_hil import FakeHIL


def hil_rig(output: bool = True, bridge: dict[str, Any] | None = None, **hil: Any) -> DeviceRig:
    section = {"card_type": "fake", "watchdog_s": PATIENCE_S, **hil}
    patient = {"stale_s": PATIENCE_S, **(bridge or {})}
    return build_device(rig_config(rig="hil", hil=section, bridge=patient), output)


@pytest.fixture
def rig() -> Iterator[DeviceRig]:
    with hil_rig() as rig:
        yield rig


def board() -> FakeHIL:
    assert FakeHIL.opened is not None
    return FakeHIL.opened


def test_without_the_package_it_says_how_to_get_it() -> None:
    with pytest.raises(RigError, match=r"quanser-sdk.*hil:fake"):
        hil_rig(card_type="q8_usb").open()


def test_it_flies(rig: DeviceRig) -> None:
    assert board().analog[:2] == [0.0, 0.0]
    assert fly(rig, 0.5, (4.0, -4.0)) is None
    assert board().analog[:2] == [4.0, -4.0]
    assert rig.read(0).counts[0] > 30


def test_closing_ends_with_zero_volts_and_everything_given_back() -> None:
    with hil_rig(enable_channels=(0, 1)) as rig:
        fly(rig, 0.2, (4.0, 4.0))
        assert board().digital == {0: 1, 1: 1}
    assert board().analog[:2] == [0.0, 0.0]
    assert board().digital == {0: 0, 1: 0}
    assert board().calls[-3:] == ["stop", "delete", "close"]
    switched = [call for call in board().calls if call.startswith("digital")]
    assert all(call.endswith("[0.0, 0.0]") for call in switched), "never under voltage"


def test_without_output_nothing_is_written() -> None:
    with hil_rig(output=False) as rig:
        assert fly(rig, 0.2) is None
    assert board().writes == 0
    assert board().calls[-1] == "close"


def test_motor_volts_become_dac_volts() -> None:
    motors = {"unit": "dac_volts", "amplifier_gain": 3.0}
    with hil_rig(bridge={"motors": motors}) as rig:
        fly(rig, 0.1, (3.0, -1.5))
        assert board().analog[:2] == [1.0, -0.5]


def test_a_flight_that_hangs_loses_its_outputs() -> None:
    with hil_rig(watchdog_s=0.2) as rig:
        assert fly(rig, 0.2, (4.0, 4.0)) is None
        assert wait_until(lambda: board().analog[:2] == [0.0, 0.0])
        assert "gave no voltage" in str(rig.read(0).fault)
        rig.write(0, (4.0, 4.0))
        time.sleep(0.1)
        assert board().analog[:2] == [0.0, 0.0]


def test_a_thread_that_hangs_is_caught_by_the_board() -> None:
    with hil_rig(watchdog_s=0.2) as rig:
        assert fly(rig, 0.2, (4.0, 4.0)) is None
        board().silent = True
        assert "no sample" in str(fly(rig, 3.0, (4.0, 4.0)))
        assert wait_until(lambda: board().analog[:2] == [0.0, 0.0])
        board().silent = False
        assert wait_until(lambda: "expired" in str(rig.read(0).fault))
        assert board().analog[:2] == [0.0, 0.0]


def test_a_card_that_is_not_there_is_a_clear_error() -> None:
    with pytest.raises(RigError, match="no such card"):
        hil_rig(card_identifier="absent").open()
