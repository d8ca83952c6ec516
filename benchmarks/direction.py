"""The `direction` coder over its floor, plant by plant; the coder's own functions, compiled.

    python -m benchmarks.direction [--encoder] [--closed] [NAME ...]

Estimation: the plant is the model, driven by white noise of the strengths that the coder was designed
for (told) or has to find (untold, from three times too weak and three times too strong). What is scored
is the weighted mean square error over all time, over the continuous causal floor.
"""

from __future__ import annotations
