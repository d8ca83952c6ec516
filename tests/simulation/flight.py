"""The paper's flight, both ends in one process, as many tests fly it."""

from __future__ import annotations

import math
from typing import Any

from channel.codec.codec import Codec
from channel.codec.coders.zoom import ZoomParameters
from channel.line.line import Line
from channel.protocol.wire import DATAGRAM, Wire
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Square
from tenbaud import MemoryFlight
from tests.channel.codec.parts import PAPER, TICK_S, pitch_codec, terms

COUNTS_PER_TURN = 4096
REFERENCE = Square(math.pi / 2, 25.0, TICK_S)


def pitch_flight(
    zoom: ZoomParameters = PAPER,
    *,
    ticks_per_sample: int = 10,
    mismatch: float = 0.0,
    uplink_line: Line | None = None,
    downlink_line: Line | None = None,
    receiver_codec: Codec | None = None,
    window_start_s: float = 25.0,
    stop_on_desync: bool = False,
    wire: Wire = DATAGRAM,
    **term_changes: Any,
) -> MemoryFlight:
    """Return the paper's flight: its plant (off by `mismatch`), its PID law, its square wave."""
    codec = pitch_codec(zoom, ticks_per_sample)
    flight_terms = terms(
        ticks_per_sample=ticks_per_sample, rate_baud=100.0 / ticks_per_sample, **term_changes
    )
    flight_terms.check("virtual")
    return MemoryFlight(
        codec,
        flight_terms,
        PitchPlant(PitchParameters().mismatched(mismatch), TICK_S),
        Pid(PAPER_GAINS, REFERENCE, TICK_S),
        receiver_codec=receiver_codec,
        uplink_line=uplink_line,
        downlink_line=downlink_line,
        scored_from_s=window_start_s,
        stop_on_desync=stop_on_desync,
        wire=wire,
    )


def largest_share(flight: MemoryFlight) -> float:
    """Return the largest coded error as a share of the largest angle, in the scored window."""
    return flight.node.scores.first.coded.largest / flight.node.scores.first.largest


def assert_lockstep(flight: MemoryFlight, samples: int) -> None:
    """One digest check per sample, every one of them equal, and nothing left over."""
    assert flight.transmitter.counts["digest_checks"] == samples
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.receiver.counts["desyncs"] == 0
    assert flight.transmitter.confirmed_state == flight.receiver.state
    assert flight.transmitter.lag_samples == 0
    digests = flight.transmitter_rows.column("sample", "digest")
    assert digests == flight.receiver_rows.column("sample", "digest")
    assert len(set(digests)) == samples
    assert flight.transmitter.counts["stale_frames"] == flight.receiver.counts["stale_frames"] == 0
