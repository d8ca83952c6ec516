"""Corruption of one copy of the codec in its last bit, to test that the difference is reported."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from channel.codec.codec import Codec, CodecState, OpenSample, Vector

_FORM = re.compile(r"sample=(\d+),field=(range|angle|rate|(?:model|coder)\.\d+)")


@dataclass(frozen=True, slots=True)
class Sabotage:
    """The field of the state that changes by one unit in the last place, and the sample."""

    sample: int
    part: str
    """of the state: `model` or `coder`"""
    index: int


def parse_sabotage(text: str) -> Sabotage:
    """Return the sabotage of a text such as `sample=500,field=range`; ValueError for any other."""
    match = _FORM.fullmatch(text.replace(" ", ""))
    if match is None:
        raise ValueError(
            f"sabotage {text!r}: write sample=500,field=NAME, where NAME is range, angle, rate, "
            "model.0, model.1 ... or coder.0, coder.1 ..."
        )
    name = {"range": "coder.0", "angle": "model.0", "rate": "model.1"}.get(match[2], match[2])
    part, _, index = name.partition(".")
    return Sabotage(int(match[1]), part, int(index))


class SabotagedCodec(Codec):
    """A codec that makes one small mistake; without a `sabotage`, none until it is armed."""

    def __init__(self, codec: Codec, sabotage: Sabotage | None = None) -> None:
        super().__init__(codec.model, codec.coder, codec.ticks_per_sample)
        self._sabotage: Sabotage | None = None
        if sabotage is not None:
            self.arm(sabotage)

    def arm(self, sabotage: Sabotage) -> None:
        """Make this mistake from now on, and no other; ValueError for a field that does not exist."""
        self.check(sabotage)
        self._sabotage = sabotage

    def check(self, sabotage: Sabotage) -> None:
        """Raise ValueError for a field that does not exist in this codec's state."""
        size = len(getattr(self.initial(), sabotage.part))
        if sabotage.index >= size:
            raise ValueError(
                f"sabotage: {sabotage.part}.{sabotage.index} does not exist; the codec's "
                f"{sabotage.part} state has {size} value(s)"
            )

    def close(self, state: CodecState, opened: OpenSample, model: Vector) -> CodecState:
        """Return the state after the sample, wrong in one bit after the one named."""
        closed = super().close(state, opened, model)
        sabotage = self._sabotage
        if sabotage is None or state.sample != sabotage.sample:
            return closed
        values = list(getattr(closed, sabotage.part))
        values[sabotage.index] = math.nextafter(values[sabotage.index], math.inf)
        if sabotage.part == "model":
            return closed._replace(model=tuple(values))
        return closed._replace(coder=tuple(values))
