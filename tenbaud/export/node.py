"""The sensor node in C: what both ends have agreed on, as constants beside the codec's."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

from channel.errors import TenbaudError
from channel.links.serial.wire import SerialWire
from channel.protocol.bounds import Bounds
from channel.protocol.frames import Symbol
from channel.protocol.limits import to_steps
from plant_sim.encoder import Encoder
from tenbaud.build.ends import build_observer, guard_settings
from tenbaud.build.flight import Agreement
from tenbaud.build.signals import build_encoders
from tenbaud.export.codec import BY_HAND, codec_files, header, listed

NODE_FILES = (
    *("wire.h", "wire.c", "guard.h", "guard.c", "node.h", "node.c", "session.c", "hardware.h"),
    *("simulated/rig.h", "simulated/rig.c", "linux/main.c"),
    *("qemu/board.h", "qemu/start.c", "qemu/main.c", "qemu/lm3s6965.ld"),
)
EXACT = Encoder(65_536.0, turn=1.0)
"""How an output that the simulated rig reads exactly is read by a board: in 65536 counts per unit."""


def node_files(agreement: Agreement) -> dict[str, str]:
    """Return the files of a node by their names; CannotExport, or TenbaudError, where there is none."""
    terms = agreement.terms
    if terms.downlink != "full":
        raise TenbaudError(
            f"the node in C speaks the downlink full, and channel.downlink is {terms.downlink!r}"
        )
    found = codec_files(agreement.codec, terms, build_observer(agreement))
    found |= {name: (BY_HAND / name).read_text(encoding="utf-8") for name in NODE_FILES}
    return found | {"terms.h": terms_header(agreement)}


def terms_header(agreement: Agreement) -> str:
    """Return the constants of the agreement: timing, limits, identity, encoders, bytes of symbols."""
    codec, terms, identity = agreement.codec, agreement.terms, agreement.identity
    signals, guard = terms.signals, guard_settings(agreement)
    pairs = zip(terms.limits.command_max, terms.initial_command, strict=True)
    steps_max = to_steps([max(limit, abs(first)) for limit, first in pairs], signals)
    readers = build_encoders(agreement.config, signals)
    encoders = [one if isinstance(one, Encoder) else EXACT for one in readers]
    kinds = len(codec.coder.alphabet.symbols)
    wire = SerialWire(kinds)
    slots = [
        [wire.encode(Symbol(0, 0, slot, number))[0] for number in range(kinds)]
        for slot in range(wire.slot_modulus)
    ]
    bounds = Bounds(codec, terms, Counter(), lambda _: None)
    values: dict[str, object] = {
        "TICK_NS": terms.tick_ns,
        "SYMBOL_DELAY_NS": terms.symbol_delay_ns,
        "HISTORY_SAMPLES": terms.history_samples,
        "SAMPLE_MAX": f"{bounds.sample_max}u",
        "REPEATS": terms.repeats,
        "INITIAL_COMMAND": listed(terms.initial_command),
        "COMMAND_MAX": listed(terms.limits.command_max),
        "SLEW_PER_TICK": listed(terms.limits.slew_per_tick),
        "STEPS_PER_UNIT": listed(signals.steps_per_unit),
        "STEPS_MAX": listed(steps_max),
        "SAFE_COMMAND": listed(guard.safe_command),
        "SOFT_LIMITS": listed(guard.soft_limits or [math.inf] * len(signals.outputs)),
        "TIMEOUT_TICKS": f"{guard.timeout_ticks}u",
        "RAMP_TICKS": f"{guard.ramp_ticks}u",
        "COUNTS_PER_TURN": listed([float(one.counts_per_turn) for one in encoders]),
        "TURN": listed([float(one.turn) for one in encoders]),
        "SIGN": listed([one.sign for one in encoders]),
        "ZERO_COUNTS": listed([one.zero_counts for one in encoders]),
        "SLOT_MODULUS": wire.slot_modulus,
        "SYMBOL_BYTES": "{" + ", ".join([hexadecimal(one) for one in slots]) + "}",
        "VERSION": '"' + identity.version.replace("\\", "?").replace('"', "?") + '"',
        "CONFIG_DIGEST": hexadecimal(identity.config_digest),
    }
    return header("TERMS", values)


def hexadecimal(values: Iterable[int]) -> str:
    """Return bytes as an initialiser."""
    return "{" + ", ".join([f"0x{one:02x}" for one in values]) + "}"
