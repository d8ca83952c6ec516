"""Replaying the commands of a recorded flight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from channel.flight_log import FlightLog
from receiver.controllers.base import Controller
from receiver.controllers.recorded import RecordedController

LOG = FlightLog(
    0.01, np.zeros((3, 1)), np.array([[0.5, -0.5], [1.0, 2.0], [3.0, 4.0]]), np.zeros((3, 1), np.int64)
)


def test_each_tick_gets_its_row_and_the_last_row_stays() -> None:
    controller: Controller = RecordedController(LOG, 2)
    commands = [controller.command(tick, (9.9, 9.9)) for tick in (0, 1, 2, 3, 1000)]
    assert commands == [(0.5, -0.5), (1.0, 2.0), (3.0, 4.0), (3.0, 4.0), (3.0, 4.0)]


def test_a_lead_skips_the_first_rows() -> None:
    assert RecordedController(LOG, 2).command(2, ()) == (3.0, 4.0)


def test_it_follows_no_reference() -> None:
    controller: Controller = RecordedController(LOG, 2)
    assert controller.references(0) == ()


def test_a_tick_below_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="tick is -1"):
        RecordedController(LOG, 2).command(-1, ())


def test_a_log_without_inputs_commands_zero() -> None:
    log = replace(LOG, commands=np.empty((3, 0)))
    assert RecordedController(log, 2).command(1, ()) == (0.0, 0.0)
