"""`docs/REPRODUCTION.md`: the paper's statements beside what was measured."""

from __future__ import annotations

from pathlib import Path

from reproduction.paper import draw, identified, plan, real, tables
from reproduction.paper.make import Results
from reproduction.paper.misprints import MISPRINTS
from tenbaud.files.whole import write_whole
from tenbaud.identify.run import FIELDS


def write_page(path: Path, results: Results) -> None:
    """Write the page; its pictures are expected in `figures/` beside it."""
    parts = [_head(), _claims(results), _identification(results), _loop(results)]
    parts += [_rates(results), _zooming(results), _recorded(results), _misprints()]
    write_whole(path, "\n\n".join(parts) + "\n")


def _head() -> str:
    return f"""# The paper, reproduced

*Estimation and control under information constraints for LAAS Helicopter Benchmark*, each of its
results beside ours. This page and its pictures are written by

<!-- test: skip, minutes of flights and recorded data that are no part of the repository -->
```sh
tenbaud figures all --docs docs --data FOLDER
```

and no number in its tables is typed in by hand. One figure alone: `tenbaud figures 7`. The flights of
Figs. 6 to 8 and the recorded flight with its tuned presets up to 25 bit/s are two processes over
Zenoh on loopback, on the virtual clock. The others, of which only the error is told, run the same two
sessions in one process, which gives the same states.

The simulated plant is (11), (12) with the paper's numbers. "10 % off" means that damping, stiffness
and torque gain are each 10 % more or less than the codec's model has them; of the eight combinations
of signs the worst is given. Flights last {plan.DURATION_S:g} s and errors count from
{draw.PERIOD_S:g} s on. An error is told as a fraction of the largest pitch in that time, and of the
reference's amplitude beside it."""


def _claims(results: Results) -> str:
    return "## What the paper says, and what we find\n\n" + tables.claims_table(results)


def _identification(results: Results) -> str:
    a, b = identified.EXCITATIONS
    best = identified.best_possible_damping_error
    return f"""## Identification (Figs. 3 and 4)

The algorithm (9)-(15) on a simulated rig with a ten-bit encoder, which rests for 5 s and is then
excited by square waves of (frequency in Hz, bias in V, magnitude in V): (a) `{a}`,
(b) `{b}`.
Repeat it with `tenbaud identify --set transmitter.encoders.counts_per_turn=1024`.

![Fig. 3](figures/paper-figure-3.png)

![Fig. 4](figures/paper-figure-4.png)

Under white torque of 2e-3 rad^2/s^3 (filters of 3 rad/s, `alpha` = 0.002), both excitations and
{len(identified.SEEDS)} seeds each:

{tables.noise_table(results)}

The damping `a_w` is the hard one. Under this torque no unbiased method can have a standard error of
`a_w` much below {tables.percent(best(a))} with (a) and {tables.percent(best(b))} with (b) after 60 s:
the Cramer-Rao bound along the undisturbed motion, for angles and rates known exactly. So 10 % cannot be
promised of a single record of that length."""


def _loop(results: Results) -> str:
    return f"""## The loop and its transmission error (Figs. 5 to 7)

![Fig. 5](figures/paper-figure-5.png)

*Fig. 5: the ideal controller, which sees the true state.*

![Fig. 6](figures/paper-figure-6.png)

*Fig. 6: T_s = 0.05 s, 20 bit/s.*

![Fig. 7](figures/paper-figure-7.png)

*Fig. 7: T_s = 0.10 s, 10 bit/s.*

Largest error, of the largest pitch / of the reference's amplitude:

{tables.transmission_table(results)}

With a plant 10 % off the model the paper's claim holds, at 10 bit/s and measured by the reference's
amplitude only just. With an exact one it does not:
the observer is then wrong by nothing but its own corrections, the signs fall into the pattern `++--`,
every second pair looks like saturation, and the range never comes down. A window of three does not see
two equal signs as saturation.

The unit of the gains in (24), plant 10 % off:

{tables.unit_table(results)}"""


def _rates(results: Results) -> str:
    return """## The rate (Fig. 8)

![Fig. 8](figures/paper-figure-8.png)

*Fig. 8: the plant is 10 % off the model and both flights read a ten-bit encoder; errors are taken
against the true rate over the first period, 25 s.*

One step of a ten-bit encoder within 10 ms is 0.61 rad/s, so plain differences jump by that much. The
usual loop is `--preset usual-1000baud`: the same two processes, ten symbols per tick."""


def _zooming(results: Results) -> str:
    return f"""## What the adaptive rule is for

Largest error as a fraction of the largest pitch. The shove is `{plan.PUSH}`, which the model knows
nothing of.

{tables.zooming_table(results)}

While nothing happens, a range that only follows the clock does as well as one that listens, and on an
exact plant better than the paper's window of two. After a shove it is too small for ever. A fixed range
has to be chosen beforehand, between the error it leaves at rest and the shove it can follow. The rule
(19) needs no such choice; the window of two, whose range stays up, pays for the quickest catch with the
largest error at rest."""


def _recorded(results: Results) -> str:
    if results.first_half is None:
        return """## Recorded flights of real helicopters

Not flown for this page: the recordings were not at hand (`--data FOLDER`)."""
    first = results.first_half
    return f"""## Recorded flights of real helicopters

A Quanser 3-DOF helicopter under its own controller, pushed by hand (120 s, 50 Hz, 4096 counts a turn;
time split: the first {real.HALF_S:g} s to learn from, the rest to be judged on). Every constant was
fitted on the first half alone. The second half was not unseen, though: its shoves are harder, and that
plain fits did badly on them led to fitting on made-up shoves, added to the first half, as well.

![Recorded flight](figures/recorded-flight.png)

{tables.recorded_table(results)}

Errors are fractions of the largest pitch of the second half,
{results.flown["uiuc-tuned-10"].pitch_rad:.2f} rad, against the encoder, at every 0.02 s. The words'
column is flattered: it takes a word of ten bits to be there at the instant of its sample.

{_first_half(first)}

Two recordings from NTNU hold no voltages: the commands are unknown and no torque is assumed.

{tables.ntnu_table(results)}"""


def _first_half(first: real.FirstHalf) -> str:
    model, regression = first.model, first.regression.estimates
    spread = first.fitted.deviations
    numbers = ", ".join(
        f"`{letter}` = {model[field]:.2f} (+- {getattr(spread, field):.2f}) {unit}"
        for field, letter, unit in FIELDS
    )
    return f"""The paper's coder flies with a model identified on the first half: {numbers}.
It is the simulation-error fit over stretches of {real.SEGMENT_S:g} s. The regression (9)-(15) alone
gives `a_w` = {regression.rate_damping_per_s:.2f} and `a_th` = {regression.stiffness_per_s2:.2f}, and
warns: hands push the body, and a controller that answers their pushes makes the voltage a consequence
of them. The largest errors are such pushes; no model can know of them. The tuned presets are
`uiuc-10baud`, `uiuc-16baud`, `uiuc-25baud` and `uiuc-50baud`."""


def _misprints() -> str:
    rows = [(place, printed, chosen) for place, printed, chosen in MISPRINTS]
    return "## Misprints and ambiguities\n\n" + tables.table(
        ("where", "printed", "chosen, and why"), rows
    )
