"""The tables of the page: what was measured, as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from reproduction.paper import draw, plan, real
from reproduction.paper.flights import Flown
from reproduction.paper.make import Results

CLAIM = 0.05
"""The paper's: 5 % of the pitch amplitude."""

LABELS = {
    "paper": "window of two signs (the paper)",
    "three": "window of three signs",
    "tuned": "tuned preset",
}
COMMANDS = {
    "paper": "`--preset paper-{rate}baud`",
    "three": "`--preset paper-{rate}baud --set coder.window_signs=3`",
    "tuned": "`--preset tuned-{rate}baud`",
}


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def percent(value: float) -> str:
    """Return a fraction with as many digits as are worth reading."""
    return f"{100.0 * value:.2f} %" if value < 0.1 else f"{100.0 * value:.1f} %"


def both(flown: Flown) -> str:
    """Return the largest error, of the largest pitch and of the reference."""
    return f"{percent(flown.largest)} / {percent(flown.largest_of_reference)}"


def family(flown: dict[str, Flown], coder: str, rate: int, off: int) -> list[Flown]:
    """Return the flights against plants that are off by this percentage, whatever the signs."""
    name = plan.flight_name(coder, rate, off)
    return [one for key, one in flown.items() if key == name or key.startswith(name + "-")]


def worst(flights: Sequence[Flown]) -> str:
    """Return the largest error among flights."""
    largest = _largest(flights)
    of_reference = max(one.largest_of_reference for one in flights)
    return f"{percent(largest)} / {percent(of_reference)}"


def transmission_table(results: Results) -> str:
    """Return the error of the transmitted pitch for each coder, rate and plant."""
    rows = []
    for rate in plan.RATES:
        for coder in plan.CODERS:
            exact = results.flown[plan.flight_name(coder, rate, 0)]
            rows.append(
                (
                    f"{rate} bit/s, {LABELS[coder]}",
                    both(exact),
                    worst(family(results.flown, coder, rate, 10)),
                    worst(family(results.flown, coder, rate, 20)),
                    COMMANDS[coder].format(rate=rate),
                )
            )
    head = (
        "",
        "exact plant",
        "10 % off, worst of 8 signs",
        "20 % off, worse of 2",
        "`tenbaud demo` with",
    )
    return table(head, rows)


def claims_table(results: Results) -> str:
    """Return the paper's statements beside ours."""
    flown = results.flown
    ten, twenty = (worst(family(flown, "paper", rate, 10)) for rate in (10, 20))
    exact = [flown[plan.flight_name("paper", rate, 0)] for rate in (20, 10)]
    observer = draw.rate_error(flown["rate-observer"])
    tuned = draw.rate_error(flown["rate-observer-tuned"])
    usual = draw.rate_error(flown["rate-usual"])
    filtered = draw.rate_error(flown["rate-usual"], 0.05)
    in_rad = flown["volts-per-rad-10baud"]
    rows = [
        (
            "Fig. 4: the estimates converge to `a_w` = 0.1, `a_th` = 0.5, `k_v` = 0.35",
            f"largest error of the three after 60 s: {_errors(results)}",
            _holds(results.trials is not None and max(results.trials.clean_errors) <= 0.03),
        ),
        (
            "Fig. 5: the ideal loop follows a square wave of pi/2",
            f"V/deg: within {results.ideal_left_rad:.2f} rad of it before each jump, overshoot to "
            f"{results.ideal_largest_rad:.2f} rad. V/rad: the pitch gets no further than "
            f"{in_rad.pitch_rad:.2f} rad",
            _holds(results.ideal_left_rad < 0.1) + ", in V/deg",
        ),
        (
            "Fig. 6: at 20 bit/s the error stays within 5 % of the pitch amplitude",
            f"{twenty} (worst of 8 plants 10 % off)",
            _holds(_largest(family(flown, "paper", 20, 10)) <= CLAIM),
        ),
        (
            "Fig. 7: the same at 10 bit/s",
            f"{ten} (worst of 8 plants 10 % off)",
            _holds(_largest(family(flown, "paper", 10, 10)) <= CLAIM),
        ),
        (
            "the same, the plant exactly the model's",
            f"20 bit/s: {both(exact[0])}; 10 bit/s: {both(exact[1])}",
            _holds(_largest(exact) <= CLAIM) + ": limit cycle of the window of two",
        ),
        (
            "Fig. 8: at 10 bit/s the observer's rate is as useful as differences at 1000 bit/s",
            f"rms error {observer:.3f} rad/s (tuned {tuned:.3f}); differences {usual:.3f}, through a "
            f"low-pass of 0.05 s {filtered:.3f}",
            _holds(observer <= usual),
        ),
    ]
    return table(("the paper", "measured: of the largest pitch / of the reference", "holds"), rows)


def _holds(it_does: bool) -> str:
    return "yes" if it_does else "**no**"


def _largest(flights: Sequence[Flown]) -> float:
    return max(one.largest for one in flights)


def _errors(results: Results) -> str:
    trials = results.trials
    if trials is None:
        return "not run"
    return ", ".join(
        f"({letter}) {percent(error)}" for letter, error in zip("ab", trials.clean_errors, strict=True)
    )


def noise_table(results: Results) -> str:
    """Return how the identification fares under white torque."""
    trials = results.trials
    if trials is None:
        return ""
    rows = []
    for label, column in (("60 s", 0), ("180 s", 1)):
        errors = sorted(pair[column] for pair in trials.noisy_errors)
        rows.append((label, percent(errors[len(errors) // 2]), percent(errors[-1])))
    head = ("record", "largest error of the three: median of the trials", "worst of the trials")
    return table(head, rows)


def unit_table(results: Results) -> str:
    """Return what the gains' unit does."""
    rows = []
    for rate in plan.RATES:
        for unit, one in (
            ("V/deg", results.flown[plan.flight_name("paper", rate, 10)]),
            ("V/rad", results.flown[f"volts-per-rad-{rate}baud"]),
        ):
            rows.append(
                (
                    f"{rate} bit/s, {unit}",
                    f"{one.pitch_rad:.2f} rad",
                    f"{one.summary['tracking_rms_rad']:.2f} rad",
                    both(one),
                )
            )
    head = ("gains in", "largest pitch", "rms distance from the reference", "largest error")
    return table(head, rows)


def zooming_table(results: Results) -> str:
    """Return the adaptive rule beside coders whose range does not listen."""
    names = {
        "paper-10baud": "adaptive, window of two (the paper)",
        "three": "adaptive, window of three",
        "tuned-10baud": "adaptive, tuned",
        "fixed-10baud": "fixed range, 0.1 rad",
        "open-loop-zoom-10baud": "time-based zooming",
        "static-10baud": "static: the sign of the angle (16)",
    }
    rows = []
    for preset, label in names.items():
        cells = []
        for case in ("exact", "10percent", "push"):
            one = results.flown[plan.zooming_name(preset, case)]
            lost = one.pitch_rad > 6.3
            cells.append("the loop is lost" if lost else percent(one.largest))
        rows.append((label, *cells))
    return table(("10 bit/s", "exact plant", "10 % off", "10 % off, and a push at 40 s"), rows)


def recorded_table(results: Results) -> str:
    """Return the second half of the recorded flight."""
    rows = []
    for rate, period_s in real.RATES:
        cells = []
        for kind in ("pcm", "paper", "tuned"):
            one = results.flown[f"uiuc-{kind}-{rate}"]
            cells.append(f"{percent(one.rms)} / {percent(one.largest)}")
        rows.append((f"{1.0 / period_s:.3g} bit/s", *cells))
    usual = results.flown["uiuc-pcm-500"]
    rows.append(("500 bit/s", f"{percent(usual.rms)} / {percent(usual.largest)}", "", ""))
    head = (
        "second half, rms / largest error",
        "ten-bit words, held",
        "paper's coder, identified model",
        "tuned on the first half",
    )
    return table(head, rows)


def ntnu_table(results: Results) -> str:
    """Return the recordings without voltages."""
    rows = []
    for name in real.NTNU_FILES:
        stem = name.removesuffix(".csv")
        found = [
            results.flown.get(f"{stem}-{preset}")
            for preset in ("paper-10baud", "tuned-10baud", "tuned-20baud")
        ]
        if all(found):
            cells = [f"{percent(one.rms)} / {percent(one.largest)}" for one in found if one]
            largest = found[0].pitch_rad if found[0] else 0.0
            rows.append((stem.replace("_", " "), f"{largest:.2f} rad", *cells))
    head = ("rms / largest error", "largest pitch", "paper, 10 bit/s", "tuned, 10", "tuned, 20")
    return table(head, rows)
