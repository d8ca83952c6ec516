"""Write golden vectors again: ``python -m tests.golden.regenerate numerics`` from the top folder.

A golden file pins bits that both ends of a link must share. Writing one again is therefore a
change of the wire format: say so in CHANGELOG.md, and never do it only to turn a test green.

To add a file, write a function that returns what JSON can hold and name it in ``GENERATORS``.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from channel.codec import numerics
from channel.codec.codec import Codec
from channel.codec.coders.direction import DirectionCoder, DirectionParameters
from channel.codec.coders.history import HistoryCoder, HistoryParameters
from channel.codec.coders.learning import LearningCoder, LearningParameters
from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder, OpenLoopZoomParameters
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.coders.static import StaticCoder, StaticParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.downlink.coded import CodedDirection
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.models.hold import HoldModel
from channel.codec.models.learned import LearnedLinearModel
from channel.codec.models.linear import LinearModel
from channel.codec.models.pitch import PITCH_SIGNALS, PitchModel, PitchParameters
from channel.protocol import frames, wire
from channel.protocol.endings import Ending
from channel.protocol.identity import numerics_probe
from channel.protocol.limits import from_steps
from tests.simulation.narrow import coded, mirrored

FOLDER = Path(__file__).resolve().parent


def numerics_vectors() -> dict[str, list[list[str]]]:
    """Return [argument, result] pairs of hex floats for each function."""
    chooser = random.Random(20240610)
    angles = [0.0, -0.0, 5e-324, 1e-300, -1e-9, 0.5, 1.0, -1.0, 1e5, -1e5]
    for quarter_turns in (1, 2, 3, 4, 5, 100, 12345, 63661):
        angle = quarter_turns * (math.pi / 2)
        angles += [angle, math.nextafter(angle, 0.0), -math.nextafter(angle, math.inf)]
    angles += [chooser.uniform(-math.pi / 4, math.pi / 4) for _ in range(60)]
    angles += [chooser.uniform(-10.0, 10.0) for _ in range(60)]
    angles += [chooser.uniform(-1e5, 1e5) for _ in range(40)]
    exponents = [0.0, -0.0, 5e-324, -1e-17, 0.5, 1.0, -1.0, 700.0, -700.0]
    exponents += [octaves * math.log(2.0) for octaves in (-1000, -1, 1, 2, 1000)]
    exponents += [chooser.uniform(-1.0, 1.0) for _ in range(60)]
    exponents += [chooser.uniform(-700.0, 700.0) for _ in range(60)]
    return {
        "sin": [[x.hex(), numerics.sin(x).hex()] for x in angles],
        "cos": [[x.hex(), numerics.cos(x).hex()] for x in angles],
        "exp": [[x.hex(), numerics.exp(x).hex()] for x in exponents],
    }


def example_frames() -> list[frames.Frame]:
    """Return one frame of every kind and variant; the golden bytes are theirs, in this order."""
    digest = 0x0123456789ABCDEF
    echo = frames.Echo(6, 1, digest, (1500, -1500, 0, 32767, -32768, 1))
    return [
        frames.Hello(0xDEADBEEF, "0.1.0", bytes(range(16)), bytes(range(100, 108))),
        frames.Hello(0, "", bytes(16), bytes(8)),
        frames.Hello(9, "1", bytes(16), bytes(8), 3, 0x01020304, 5, 77, frames.Why.GAP),
        frames.Welcome(0x01020304, 5, 6, 0xDEADBEEF),
        frames.Welcome(0x01020304, 5, 6, 0xDEADBEEF, 3, (1500, -1500), bytes(range(40))),
        frames.Refuse(0xDEADBEEF, Ending.MISMATCH, "versions: 1 and \u00b5", '{"rate_baud": 10.0}'),
        frames.Symbol(0x01020304, 5, 0x0A0B0C0D, 1),
        frames.Symbol(0xFFFFFFFF, 0xFFFF, 0xFFFFFFFF, 0xFF),
        frames.Commands(0x01020304, 5, (echo,)),
        frames.Commands(0x01020304, 5, (echo, frames.Echo(7, 0xFFFF, 2**64 - 1, (0, 1, 2, 3, 4, 5)))),
        frames.Commands(0x01020304, 0, (frames.Echo(0, 0, 0, ()),)),
        frames.Desync(0x01020304, 5, 300, digest, digest + 1, bytes(range(32))),
        frames.Desync(0x01020304, 5, 0, 0, 1, b""),
        frames.Bye(0x01020304, Ending.OVER, "done"),
        frames.Bye(0, Ending(200)),
        frames.Unknown(0x01020304, 5),
        frames.Claim(0x01020304, 5, 0x0A0B0C0D),
        frames.DownSymbol(0x01020304, 5, 0x0A0B0C0D, 1),
    ]


def frame_vectors() -> dict[str, list[list[str]]]:
    """Return [kind, bytes in hex] of `example_frames`."""
    examples = example_frames()
    return {"frames": [[type(frame).__name__, wire.encode(frame).hex()] for frame in examples]}


AERO = LinearModel(
    (
        (0.999913, 0.00998322, 0.0, 0.0),
        (-0.0173662, 0.996616, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.00995373),
        (0.0, 0.0, 0.0, 0.99076),
    ),
    (
        (2.55529e-06, 4.87828e-06),
        (0.000510769, 0.000975105),
        (-5.67862e-06, 4.62702e-06),
        (-0.00113397, 0.000923975),
    ),
    ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)),
    0.01,
)
AERO_DIRECTION = DirectionParameters(
    transition=(
        (0.99141, 0.0980819, 0.0, 0.0),
        (-0.170617, 0.95902, 0.0, 0.0),
        (0.0, 0.0, 1.0, 0.095499),
        (0.0, 0.0, 0.0, 0.911351),
    ),
    noise=(
        (6.48154e-07, 9.62006e-06, 0.0, 0.0),
        (9.62006e-06, 0.000192429, 0.0, 0.0),
        (0.0, 0.0, 6.22199e-07, 9.12006e-06),
        (0.0, 0.0, 9.12006e-06, 0.000182532),
    ),
    worth=(
        (1.7128, 0.142798, 0.0, 0.0),
        (0.142798, 0.0253156, 0.0, 0.0),
        (0.0, 0.0, 1.20751, 0.0853921),
        (0.0, 0.0, 0.0853921, 0.0162508),
    ),
    start=(
        (5.06312e-06, 2.68876e-05, 0.0, 0.0),
        (2.68876e-05, 0.00032425, 0.0, 0.0),
        (0.0, 0.0, 4.53875e-06, 2.42168e-05),
        (0.0, 0.0, 2.42168e-05, 0.000292631),
    ),
    bits=2,
)
"""Two axes at 20 bit/s, designed once and written down: no golden bit depends on a library."""

PITCH_DIRECTION = DirectionParameters(
    transition=((0.997508, 0.0994173), (-0.0497087, 0.987567)),
    noise=((6.6e-07, 9.9e-06), (9.9e-06, 0.000197)),
    worth=((1.76, 0.152), (0.152, 0.0288)),
    start=((5.7e-06, 3.05e-05), (3.05e-05, 0.000353)),
    step=1.15,
    removed=0.7,
)

LEARNED_PITCH = LearnedLinearModel(
    LinearModel(
        ((0.999975, 0.00999483), (-0.00499741, 0.998976)),
        ((1.7e-05, -1.7e-05), (0.0034982, -0.0034982)),
        ((1.0, 0.0),),
        0.01,
    ),
    ((0.0, 1.0), (-0.5, -0.1)),
    ((0.0, 0.0), (0.35, -0.35)),
    ((), ()),
    0.2,
)
PITCH_LEARNING = LearningParameters(
    transition=PITCH_DIRECTION.transition,
    noises=(PITCH_DIRECTION.noise,),
    worth=PITCH_DIRECTION.worth,
    starts=(PITCH_DIRECTION.start,),
    reach=((0.0999169, 0.00498337), (-0.00249169, 0.0994186)),
    spreads=LEARNED_PITCH.spreads,
    drift=0.001,
)

GOLDEN_CODECS: dict[str, Codec] = {
    "paper": Codec(PitchModel(PitchParameters(), 0.01), ZoomCoder(ZoomParameters()), 10),
    "three signs, impulse": Codec(
        PitchModel(PitchParameters(), 0.01),
        ZoomCoder(ZoomParameters(window=3, gains=((0.4,), (0.6,)), impulse=True)),
        5,
    ),
    "time-based zooming": Codec(
        PitchModel(PitchParameters(), 0.01), OpenLoopZoomCoder(OpenLoopZoomParameters()), 10
    ),
    "memoryless, three bits": Codec(
        PitchModel(PitchParameters(), 0.01), StaticCoder(StaticParameters(bits=3)), 5
    ),
    "words of ten bits": Codec(HoldModel(0.01), PcmCoder(PcmParameters(rate_filter_s=0.03)), 1),
    "history of three signs": Codec(
        PitchModel(PitchParameters(), 0.01),
        HistoryCoder(
            HistoryParameters(
                rows=((0.5, 0.3, 0.6), (0.7, 0.9, 1.1), (0.4, 1.1, 0.7), (1.2, 1.0, 1.5)),
                initial_range=0.1,
                minimum_range=0.02,
                maximum_range=0.4,
                period_s=0.1,
            )
        ),
        10,
    ),
    "direction of a linear plant, two signs": Codec(AERO, DirectionCoder(AERO_DIRECTION), 10),
    "direction of the pitch": Codec(
        PitchModel(PitchParameters(), 0.01), DirectionCoder(PITCH_DIRECTION), 10
    ),
    "learning the pitch": Codec(LEARNED_PITCH, LearningCoder(PITCH_LEARNING, (1,) * 5, 2), 10),
}


def codec_vectors(codecs: Mapping[str, Codec] = GOLDEN_CODECS) -> dict[str, list[list[object]]]:
    """Return [word, steps of all ticks, digest, model in hex, coder in hex] of each sample."""
    chooser = random.Random(20240614)
    vectors: dict[str, list[list[object]]] = {}
    for name, codec in codecs.items():
        state = codec.initial()
        rows: list[list[object]] = []
        for sample in range(60):
            word = None if sample % 9 == 4 else _word(codec, chooser)
            pairs = [
                (chooser.randrange(-5000, 5001), chooser.randrange(-5000, 5001))
                for _ in range(codec.ticks_per_sample)
            ]
            state = codec.step(state, word, [from_steps(pair, PITCH_SIGNALS) for pair in pairs])
            rows.append(
                [
                    word and list(word),
                    [value for pair in pairs for value in pair],
                    f"{codec.digest(state):016x}",
                    [value.hex() for value in state.model],
                    [value.hex() for value in state.coder],
                ]
            )
        vectors[name] = rows
    return vectors


def two_way_machines() -> dict[str, TwoWay]:
    """Return state machines of the narrow downlink: two symbols a sample, and one."""
    direction = CodedDirection((0.5, -0.5), (1.0, -1.0))
    return {
        "mirrored": mirrored(Layout(2, 1, 4), 15),
        "mirrored, one symbol": mirrored(Layout(1, 1, 8), 0),
        "coded": coded(Layout(2), direction, 8),
    }


def two_way_vectors() -> dict[str, list[object]]:
    """Return [word, command symbols, digest after them] for each machine, and its numerics probe."""
    vectors: dict[str, list[object]] = {}
    for name, machine in two_way_machines().items():
        chooser = random.Random(f"two ways, {name}")
        state = machine.initial()
        rows: list[object] = [numerics_probe(machine.codec, machine).hex()]
        for sample in range(60):
            word = None if sample % 9 == 8 else _word(machine.codec, chooser)
            symbols = [chooser.choice((0, 1)) for _ in range(machine.commands_in(state))]
            state = machine.step(state, word, symbols).state
            rows.append([word and list(word), symbols, f"{machine.digest(state):016x}"])
        vectors[name] = rows
    return vectors


def _word(codec: Codec, chooser: random.Random) -> tuple[int, ...]:
    """Return a word; of single signs more +1 than -1, so that ranges grow as well as shrink."""
    alphabet = codec.coder.alphabet
    if alphabet.symbols == (-1, 1) and alphabet.symbols_per_word == 1:
        return (chooser.choice((-1, 1, 1)),)
    return tuple(chooser.choice(alphabet.symbols) for _ in range(alphabet.symbols_per_word))


GENERATORS: dict[str, Callable[[], object]] = {
    "codec": codec_vectors,
    "frames": frame_vectors,
    "numerics": numerics_vectors,
    "two_way": two_way_vectors,
}
"""Name of each golden file (without .json) and what makes its content."""


def main(names: list[str]) -> int:
    """Write the named files; with an unknown name, or none, write nothing and list the names."""
    unknown = [name for name in names if name not in GENERATORS]
    if unknown or not names:
        print(f"usage: python -m tests.golden.regenerate NAME...  ({', '.join(GENERATORS)})")
        return 2
    for name in names:
        path = FOLDER / f"{name}.json"
        path.write_text(render(GENERATORS[name]()), encoding="utf-8")
        print(f"wrote {path.name}")
    return 0


def render(content: object) -> str:
    """Return JSON with one vector on each line, so that a review shows which bits changed."""
    if not isinstance(content, dict):
        return json.dumps(content, indent=1) + "\n"
    parts = []
    for key, value in content.items():
        if isinstance(value, list):
            lines = ",\n  ".join(json.dumps(item) for item in value)
            parts.append(f" {json.dumps(key)}: [\n  {lines}\n ]")
        else:
            parts.append(f" {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
