"""Coders: the word for a measurement, and the meaning of a word at both ends.

Each is built from its parameters, `coders.ZoomCoder(coders.ZoomParameters(window=3))`, and plugs into a
`Codec`. A coder of your own is a class that fulfils the protocol `Coder`: it declares its symbols with
an `Alphabet`, and is given `ERASED` for a word that did not arrive.
"""

from __future__ import annotations

from channel.codec.codec import ERASED, Alphabet, Coder, CoderContext, Vector, Word
from channel.codec.coders.history import HistoryCoder, HistoryParameters
from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder, OpenLoopZoomParameters
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.coders.static import StaticCoder, StaticParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters

__all__ = [
    "ERASED",
    "Alphabet",
    "Coder",
    "CoderContext",
    "HistoryCoder",
    "HistoryParameters",
    "OpenLoopZoomCoder",
    "OpenLoopZoomParameters",
    "PcmCoder",
    "PcmParameters",
    "StaticCoder",
    "StaticParameters",
    "Vector",
    "Word",
    "ZoomCoder",
    "ZoomParameters",
]
