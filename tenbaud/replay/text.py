"""The outcome of a replay as text."""

from __future__ import annotations

from tenbaud.replay.replay import Replayed


def replay_text(replayed: Replayed) -> str:
    """Return the outcome of a replay."""
    packed = replayed.packed
    size = f"{len(packed.symbols)} bytes of symbols"
    if packed.erasures:
        size += f" and {len(packed.erasures)} that mark {replayed.erased} erasures"
    lines = [
        f"{replayed.samples} samples, {replayed.bits_sent:g} bits: the whole flight is {size}",
        f"beside it, known beforehand: {len(packed.head)} bytes of configuration, packed",
    ]
    if replayed.epochs > 1:
        lines.append(
            f"{replayed.epochs} epochs; rejoins sent {packed.start_bytes} bytes of states down the link"
        )
    if replayed.steps:
        lines.append(f"the set-point was moved by hand; {len(replayed.steps)} steps were recorded")
    if replayed.equal:
        lines.append(
            f"flown again: all {replayed.digests_compared} digests of both recordings are equal, and "
            "so are the commands"
        )
    elif replayed.differences:
        lines += ["flown again, it is not the flight that was recorded:"]
        lines += [f"  {difference}" for difference in replayed.differences]
    else:
        lines.append("no state could be compared")
    return "\n".join(lines)
