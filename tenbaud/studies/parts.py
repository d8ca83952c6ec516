"""The parts of a flight that depend on the kinds of model, coder, plant and law, as placeholders.

`compiled` puts functions of those kinds, and the numbers of signals, in their place. They are here so
that the flight can be read, and checked, as ordinary source.
"""

from __future__ import annotations

from typing import Any

INPUTS, OUTPUTS = 0, 0
"""numbers of them, known when the flight is compiled"""


def _part(*_: Any) -> Any:
    raise AssertionError("a flight is compiled before it is flown")


tick = _part
"""`tick_function` of the model, or all rows of its `row_function`"""
output_of = _part
"""(state, constants, place) -> an output, as the model has it"""
encode = decode = _part
"""the coder's functions"""
plant_step = _part
"""(state, command, push, constants, sine) -> the plant's state one step later"""
plant_output = _part
"""(state, constants, place) -> an output of the plant"""
law = _part
"""(tick, live state, constants, given, work) -> whether all is well; see `laws.py`"""
sine = _part
"""the plant's sine, that of `channel.codec.numerics`"""
state_of = held_of = command_of = plant_of = push_of = _part
"""what reads a model state, a correction, a command, a plant state, a push out of an array"""
