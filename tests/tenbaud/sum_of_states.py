"""A linear plant of two outputs, of which one is no state but a sum of states."""

from __future__ import annotations

SUM_OF_STATES = {
    "kind": "linear",
    "A": [[0.0, 1.0, 0.0], [-0.5, -0.1, 0.1], [0.0, 0.0, -0.3]],
    "B": [[0.0, 0.0], [0.35, -0.35], [0.1, 0.2]],
    "C": [[1.0, 0.0, 0.0], [0.5, 0.0, 1.0]],
    "G": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "densities": [2e-3],
    "states": ["angle", "rate", "drift"],
    "state_units": ["rad", "rad/s", "rad"],
    "inputs": ["front", "rear"],
    "input_units": ["V", "V"],
    "outputs": ["angle", "sum"],
    "output_units": ["rad", "rad"],
}
