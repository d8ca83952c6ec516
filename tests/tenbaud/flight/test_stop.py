"""Signals that end a process: none is lost, even where a library drops the exception."""

from __future__ import annotations

import contextlib
import os
import signal

import pytest

from tenbaud.flight.stop import Interruptions, StopFlag


def test_an_interrupt_that_a_library_dropped_ends_the_command_before_it_flies() -> None:
    with Interruptions() as interruptions:
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        assert interruptions.received is signal.SIGINT
        with pytest.raises(KeyboardInterrupt):
            StopFlag().__enter__()
        assert signal.getsignal(signal.SIGINT) == interruptions._on_signal, "its handler stays"


def test_a_flag_is_raised_by_the_first_signal_and_the_second_ends_at_once() -> None:
    with Interruptions() as interruptions, StopFlag() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        assert stop()
        assert interruptions.received is None
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
