"""The section of the narrow downlink."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from channel.codec.downlink.layout import SYMBOLS_MAX
from channel.codec.downlink.mirrored import BITS_MAX
from tenbaud.config.section import Factor, Section

PerSteered = Factor | tuple[Factor, ...] | dict[str, Factor] | None
"""A set-point for all outputs, a list with one for each, or a table by name."""
Share = Annotated[float, Field(ge=1e-6, le=100.0)]
"""Of the largest value that the limits of the inputs let through."""
ANNOUNCE_S_MAX = 60.0
OF_SCHEME = {
    "mirrored": ("bits", "announce_s", "set_point_min", "set_point_max", "law"),
    "coded": ("directions", "turns", "feedback", "range_min", "range_max", "value_max"),
}
"""Fields that change nothing with the other scheme."""


class StateLawSection(Section):
    """The law `state_feedback` by value, for two ends whose libraries design different digits.

    u = base + F r - K x + K_i z, a row for each input. Empty: as designed.
    """

    base: tuple[Factor, ...] = ()
    """the input where all states, set-points and integrals are 0"""
    gains: tuple[tuple[Factor, ...], ...] = ()
    """K: a column for each state"""
    forward: tuple[tuple[Factor, ...], ...] = ()
    """F: a column for each output"""
    integral_gains: tuple[tuple[Factor, ...], ...] = ()
    """K_i: a column for each output"""
    conditional: bool = True
    """whether an integral rests while more of it would change no input"""


class DownlinkSection(Section):
    """What the symbols of the narrow downlink say; shared, without effect on other downlinks."""

    scheme: Literal["auto", "mirrored", "coded"] = "auto"
    """mirrored: the law runs at both ends, beside the plant as well, and only set-points go down;
    coded: the commands of any controller go down; "auto": mirrored for the controllers `pid` and
    `state_feedback`, coded for others"""
    symbols_per_sample: Annotated[int, Field(ge=1, le=SYMBOLS_MAX)] | Literal["auto"] = "auto"
    """"auto": as many as channel.downlink_baud carries, and no more than 32"""
    command_symbols: Annotated[int, Field(ge=1, le=SYMBOLS_MAX)] = 1
    """of a sample that has any; its other symbols are hash symbols"""
    command_period: Annotated[int, Field(ge=1, le=1000)] | Literal["auto"] = "auto"
    """samples from one with command symbols to the next, while no word is being sent; "auto": for
    set-points 4, or 8 with one symbol a sample; for coded commands 1, or 2 with one symbol a sample"""
    bits: Annotated[int, Field(ge=1, le=BITS_MAX)] = 9
    """mirrored: of the word of a set-point"""
    announce_s: Annotated[float, Field(ge=0.0, le=ANNOUNCE_S_MAX)] | Literal["auto"] = "auto"
    """mirrored: a set-point takes effect so long after it changes, and the configured ones are sent so
    much earlier; 0: each bit acts when it comes, for set-points by hand; "auto": as long as a word and
    a round trip take"""
    set_point_min: PerSteered = None
    """mirrored: least set-point that a word says: one for all outputs, a list or a table by name"""
    set_point_max: PerSteered = None
    """mirrored: largest one; none for either: the output's own range, or, where it has none, the
    configured set-points and a sixth of their span beyond"""
    law: StateLawSection = StateLawSection()
    directions: tuple[tuple[Factor, ...], ...] = ()
    """coded: rows with a share of each input; a symbol is about one row's value. Two motors that push
    against each other: [[0.5, -0.5]]. Empty: each input"""
    turns: tuple[Annotated[int, Field(ge=0, le=1000)], ...] = ()
    """coded: the direction that each symbol is about, repeated; empty: one after another"""
    feedback: tuple[tuple[Factor, ...], ...] = ()
    """coded: for each direction a row K, a column for each state: its value is predicted as -K x;
    empty: the value is held"""
    range_min: Share = 0.15
    """coded: smallest range of a direction's value, and the first one"""
    range_max: Share = 0.8
    """coded: largest range"""
    value_max: Share = 2.0
    """coded: a value is held within this, either way"""
