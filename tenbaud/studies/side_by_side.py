"""Flying several seeds of one point at a time, in the lanes of the processor's registers."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from channel.codec import Codec
from tenbaud.studies.compiled import compiled, lane_reader, lane_writer, reader
from tenbaud.studies.figures import FlightFigures
from tenbaud.studies.flight_data import Errors, Motion
from tenbaud.studies.flights import NOTHING, CompiledPoint, flight_figures, torque_of
from tenbaud.studies.lane_data import LaneWork
from tenbaud.studies.lane_sine import lane_sine
from tenbaud.studies.lanes import fly_lanes
from tenbaud.studies.schedule import Schedule, Uncommon

LANES = 32
"""Flights side by side: four registers of eight numbers, so that one is worked on while others wait."""

LANE_TICKS_MAX = 2_000_000
"""Ticks of all lanes together: their arrays then take a hundred megabytes, and no processor's cache."""

FEWEST = 4
"""Fewer flights than this are faster one after the other."""


MULTIPLE = 8
"""Lanes of one register; a number of lanes that is no multiple would leave some to be flown alone."""


def fly_seeds(point: CompiledPoint, seeds: Sequence[int]) -> list[FlightFigures | None]:
    """Fly a point with these seeds; None for flights that only the nodes can fly."""
    figures: list[FlightFigures | None] = []
    lanes = min(LANES, LANE_TICKS_MAX // point.numbers.ticks // MULTIPLE * MULTIPLE)
    while lanes and can_share(point) and len(seeds) >= FEWEST:
        figures += fly_side_by_side(point, seeds[:lanes])[0]
        seeds = seeds[lanes:]
    for seed in seeds:
        try:
            figures.append(point.fly(seed)[0])
        except Uncommon:
            figures.append(None)
    return figures


def can_share(point: CompiledPoint) -> bool:
    """Return whether flights of this point differ in nothing but the torque of their seed."""
    numbers = point.numbers
    return not (numbers.replay or point.agreement.faults.any or numbers.soft_limit < math.inf)


def machine_code(point: CompiledPoint) -> list[str]:
    """Return what the flights were compiled to, for whoever wants to read it."""
    return list(_compiled_lanes(point.agreement.codec).inspect_asm().values())


def fly_side_by_side(
    point: CompiledPoint, seeds: Sequence[int]
) -> tuple[list[FlightFigures | None], LaneWork]:
    """Fly up to `LANES` seeds of a point that `can_share`; None for those that leave the common course.

    Also returned is what the lanes, in the order of the seeds, went through; it holds until the next
    call in this thread.
    """
    numbers, codec = point.numbers, point.agreement.codec
    schedule = point.schedule(point.agreement)
    work = _work(point, -(-len(seeds) // MULTIPLE) * MULTIPLE)
    if work.torque.shape[0] > 1:
        for lane, seed in enumerate(seeds):
            work.torque[:, lane] = torque_of(point.config, seed, numbers.ticks)
    given = point.given(schedule, NOTHING)
    try:
        in_time = _compiled_lanes(codec)(numbers, point.constants, given, work)
    except ValueError:
        in_time = False
    if not in_time:
        return [None] * len(seeds), work
    figures = _figures(point, work, schedule)
    return [figures[lane] if work.well[lane] else None for lane in range(len(seeds))], work


def _figures(point: CompiledPoint, work: LaneWork, schedule: Schedule) -> list[FlightFigures]:
    """Return the figures of every lane."""
    numbers = point.numbers
    at = np.arange(numbers.window_start, numbers.ticks)
    scored = schedule.scored[at // numbers.per_sample]
    coded, live = np.count_nonzero(scored), np.count_nonzero(scored & (at >= numbers.lead))
    motion = Motion(0.0, 0.0, 0, 0, 0, int(np.count_nonzero(schedule.late)))
    rows = zip(work.squares.T.tolist(), work.largest.T.tolist(), strict=True)
    return [
        flight_figures(
            Errors(
                int(coded),
                squares[0],
                largest[0],
                int(live),
                squares[1],
                largest[1],
                len(at),
                squares[2],
                largest[2],
            ),
            motion,
            schedule.erasures,
            len(schedule.scored),
        )
        for squares, largest in rows
    ]


def _compiled_lanes(codec: Codec) -> Any:
    """Return the compiled flights for a codec's kinds of model and coder."""
    encode, decode = codec.coder.functions  # type: ignore[attr-defined]
    sine = compiled(lane_sine)
    states, corrections = codec.model.state_size, codec.model.correction_size
    parts = (
        ("tick", compiled(codec.model.tick_function, (("sin", sine),))),  # type: ignore[attr-defined]
        ("encode", compiled(encode)),
        ("decode", compiled(decode)),
        ("state_of", reader(states)),
        ("held_of", reader(corrections)),
        ("sine", sine),
        ("lane_state", lane_reader(states)),
        ("lane_held", lane_reader(corrections)),
        ("keep_state", lane_writer(states)),
    )
    return compiled(fly_lanes, parts)


_kept = threading.local()


def _work(point: CompiledPoint, lanes: int) -> LaneWork:
    """Return the arrays of so many flights, ready to be flown.

    A thread keeps its last: given back, the system would take the memory and hand it out anew page by
    page, which takes half as long as the flights.
    """
    numbers, codec, config = point.numbers, point.agreement.codec, point.config
    samples = -(-numbers.ticks // numbers.per_sample)
    sizes = (
        lanes,
        samples,
        numbers.ticks,
        samples * numbers.per_sample + numbers.lead,
        numbers.ticks if config.transmitter.plant.disturbance else 1,
        codec.model.state_size,
        codec.model.correction_size,
        len(codec.initial().coder),
        codec.coder.alphabet.symbols_per_word,
    )
    if getattr(_kept, "sizes", None) != sizes:
        _kept.work, _kept.sizes = _new_work(*sizes), sizes
    work: LaneWork = _kept.work
    for zeros in (work.torque, work.held, work.plant, work.integral, work.squares, work.largest):
        zeros[...] = 0.0
    for zeros in (work.counts, work.still):
        zeros[...] = 0
    work.well[:] = True
    work.models[0] = codec.model.initial()
    work.coders[0] = codec.initial().coder
    work.plant[0] = config.transmitter.plant.initial_angle_rad
    initial = np.array([numbers.initial_front, numbers.initial_rear])
    work.commanded[: numbers.lead + 1] = initial[:, None]
    work.applied[0] = np.array([numbers.safe_front, numbers.safe_rear])[:, None]
    return work


def _new_work(
    lanes: int,
    samples: int,
    ticks: int,
    ahead: int,
    torques: int,
    states: int,
    corrections: int,
    coder: int,
    per_word: int,
) -> LaneWork:
    return LaneWork(
        torque=np.empty((torques, lanes)),
        models=np.empty((samples + 1, lanes, states)),
        coders=np.empty((samples + 1, lanes, coder)),
        sent=np.zeros((samples, lanes, per_word), dtype=np.int64),
        model=np.empty((lanes, states)),
        coder=np.empty((lanes, coder)),
        spare=np.empty((lanes, coder)),
        correction=np.empty(corrections),
        state=np.empty((states, lanes)),
        held=np.empty((corrections, lanes)),
        nothing=np.zeros((corrections, lanes)),
        plant=np.empty((4, lanes)),
        integral=np.empty(lanes),
        counts=np.empty(lanes, dtype=np.int64),
        still=np.empty(lanes, dtype=np.int64),
        well=np.empty(lanes, dtype=np.bool_),
        commanded=np.empty((ahead + 1, 2, lanes)),
        applied=np.empty((ticks + 1, 2, lanes)),
        coded=np.empty((ahead, lanes)),
        live=np.empty((ahead, lanes)),
        squares=np.empty((3, lanes)),
        largest=np.empty((3, lanes)),
    )
