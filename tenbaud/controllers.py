"""Controllers, which turn estimates into motor voltages, and the set-points that they follow.

A controller of your own is a class that fulfils the protocol `Controller`. It runs at the receiver only
and is free to use any arithmetic and any library.
"""

from __future__ import annotations

from receiver.controllers.base import Controller, ControllerContext
from receiver.controllers.pid import PAPER_GAINS, Pid, PidGains
from receiver.controllers.references import Constant, Reference, Sine, Square, Step
from tenbaud.build.references import Csv

__all__ = [
    "PAPER_GAINS",
    "Constant",
    "Controller",
    "ControllerContext",
    "Csv",
    "Pid",
    "PidGains",
    "Reference",
    "Sine",
    "Square",
    "Step",
]
