"""The flights of the figures and the table."""

from __future__ import annotations

from itertools import product

from reproduction.paper.flights import Job, Overrides

DURATION_S = 75.0
"""Three periods of the reference; errors count over the last two."""

RATE_S = 25.0
"""One period, for Fig. 8."""

RATES = (10, 20)
SIGNS = tuple(product((1.0, -1.0), repeat=3))
"""Signs of the mismatch of damping, stiffness and torque gain."""

CODERS = ("paper", "three", "tuned")
"""Paper preset; the same with a window of three signs; tuned preset."""

PUSH = "step=2@40..41"
"""A shove of 2 rad/s^2 for one second: as much as 2.9 V on each motor."""

ZOOMINGS = (
    "paper-10baud",
    "three",
    "fixed-10baud",
    "open-loop-zoom-10baud",
    "static-10baud",
    "tuned-10baud",
)


def plant(
    mismatch: float | tuple[float, ...], disturbance: str = "", more: Overrides | None = None
) -> Overrides:
    """Return the overrides of a flight against a plant that is off the model."""
    section = {"mismatch": mismatch, "disturbance": disturbance}
    return {"duration_s": DURATION_S, "transmitter": {"plant": section}, **(more or {})}


def coder_job(coder: str, rate: int, name: str, overrides: Overrides, **more: bool) -> Job:
    """Return a flight of one of `CODERS`."""
    preset = f"{'tuned' if coder == 'tuned' else 'paper'}-{rate}baud"
    if coder == "three":
        overrides = {**overrides, "coder": {"window_signs": 3}}
    return Job(name, preset, overrides, **more)


def flight_name(coder: str, rate: int, percent: int) -> str:
    """Return the name of the flight against the plant whose three constants are all too large."""
    return f"{coder}-{rate}baud-{percent}percent"


def pitch_jobs() -> list[Job]:
    """Return the flights of Figs. 6 and 7 and of the table beside them."""
    jobs = []
    for coder, rate, percent in product(CODERS, RATES, (0, 10, 20)):
        jobs.append(
            coder_job(
                coder,
                rate,
                flight_name(coder, rate, percent),
                plant(percent / 100.0),
                processes=coder == "paper" and percent < 20,
                keep_series=coder == "paper" and percent < 20,
            )
        )
    for coder, rate, percent in product(CODERS, RATES, (10, 20)):
        for index, signs in enumerate(SIGNS[1:], 1):
            if percent == 20 and index != len(SIGNS) - 1:
                continue
            off = tuple(percent / 100.0 * sign for sign in signs)
            name = f"{flight_name(coder, rate, percent)}-{index}"
            jobs.append(coder_job(coder, rate, name, plant(off)))
    return jobs


def unit_jobs() -> list[Job]:
    """Return the flights with the gains read in V/rad."""
    in_rad = {"receiver": {"pid": {"unit": "V/rad"}}}
    return [
        Job(f"volts-per-rad-{rate}baud", f"paper-{rate}baud", plant(0.1, more=in_rad)) for rate in RATES
    ]


def rate_jobs() -> list[Job]:
    """Return the flights of Fig. 8: a ten-bit encoder at all."""
    encoder = {"encoders": {"counts_per_turn": 1024}, "plant": {"mismatch": 0.1}}
    flight = {"duration_s": RATE_S, "transmitter": encoder}
    return [
        Job(name, preset, flight, processes=True, keep_series=True)
        for name, preset in (
            ("rate-observer", "paper-10baud"),
            ("rate-observer-tuned", "tuned-10baud"),
            ("rate-usual", "usual-1000baud"),
        )
    ]


def zooming_name(preset: str, case: str) -> str:
    """Return the name of a flight of `zooming_jobs`, or of the same one among `pitch_jobs`."""
    coder = {"paper-10baud": "paper", "three": "three", "tuned-10baud": "tuned"}.get(preset)
    if coder is None or case == "push":
        return f"zooming-{preset}-{case}"
    return flight_name(coder, 10, 0 if case == "exact" else 10)


def zooming_jobs() -> list[Job]:
    """Return the flights that show what the adaptive rule is for."""
    jobs = []
    for preset in ZOOMINGS:
        for label, overrides in (
            ("exact", plant(0.0)),
            ("10percent", plant(0.1)),
            ("push", plant(0.1, PUSH)),
        ):
            name = zooming_name(preset, label)
            if not name.startswith("zooming"):
                continue
            if preset == "three":
                jobs.append(coder_job("three", 10, name, overrides))
            else:
                jobs.append(Job(name, preset, overrides))
    return jobs
