"""One flight of a study, flown by the nodes themselves: both sessions in this process."""

from __future__ import annotations

import math
from dataclasses import replace

from channel.errors import TenbaudError
from channel.protocol.wire import DATAGRAM
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.schema import FlightConfig
from tenbaud.flight import transmit
from tenbaud.flight.outcome import ExitCode, NotFlown, Outcome, outcome_of
from tenbaud.studies.figures import FlightFigures, OutputFigures
from transmitter.metrics.scores import ErrorMeter


def fly_plain(config: FlightConfig, window_start: int | None = None, why: str = "") -> FlightFigures:
    """Fly a configuration as `tenbaud demo --link memory` does, and return its figures.

    Errors count from tick `window_start` on; where a flight's usually do, if not given. `why`: the
    reason that it is not compiled.
    """
    try:
        agreement = replace(agree(config, "virtual"), scored_from=window_start)
    except (TenbaudError, ValueError) as error:
        return FlightFigures(str(error), "plain", "", (), erasures=0, commands_late=0, samples=0)
    run = transmit.prepare(agreement, None, DATAGRAM)
    endpoint = build_receiver(agreement, None, DATAGRAM)
    scores = run.node.scores
    try:
        outcome = transmit.fly_virtual(run, endpoint, lambda: False)
    except (TenbaudError, ValueError) as error:
        outcome = outcome_of(error)
    node = run.node
    # While the line rests at the end, the receiver may erase samples that were never flown.
    heard = node.session.next_sample
    flown = min(heard, -(-run.ticks // agreement.terms.ticks_per_sample))
    return FlightFigures(
        outcome="ok" if _has_flown(outcome) else outcome.text,
        engine="plain",
        not_compiled=why,
        outputs=tuple(
            OutputFigures(
                error_coded_rms=_rms(one.coded),
                error_coded_max=one.coded.largest,
                error_live_rms=_rms(one.live),
                error_live_max=one.live.largest,
                tracking_rms=_rms(one.tracking),
                amplitude=one.largest,
            )
            for one in scores.outputs
        ),
        erasures=node.session.counts["erasures"] - (heard - flown),
        commands_late=node.commands_late,
        samples=flown,
    )


def _has_flown(outcome: Outcome) -> bool:
    """Return whether a flight's errors are results.

    A study may ask for a line that carries next to nothing, or for a rate at which a pendulum falls:
    what comes of that is its result.
    """
    if outcome.code is ExitCode.NOT_FLOWN:
        return set(outcome.not_flown) <= {NotFlown.NO_WORDS, NotFlown.NO_COMMANDS, NotFlown.FELL}
    return outcome.code is ExitCode.OK


def _rms(meter: ErrorMeter) -> float:
    return math.nan if meter.rms is None else meter.rms
