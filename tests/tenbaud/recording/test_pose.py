"""The poses of a figure are those of their moments, in the unit of the plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from channel.codec.models.helicopter import HELICOPTER_SIGNALS
from channel.codec.models.pendulum import PENDULUM_SIGNALS
from channel.codec.signals import Signals
from tenbaud.recording.envelope import Curve, Envelope, Series
from tenbaud.recording.pose import MOMENTS, draw_poses, has_poses, helicopter_lines, pendulum_lines

TICKS = 40_000
TIMES_S = np.arange(TICKS) / 100.0


def curve_of(times: Series, values: Series) -> Curve:
    envelope = Envelope()
    envelope.add(times, values)
    return envelope.curve()


def drawn(plant: Signals, true: list[Curve], estimated: list[Curve]) -> list[list[Series]]:
    """Return the points of every line of each moment."""
    from matplotlib.figure import Figure

    panel = Figure().add_subplot()
    draw_poses(panel, plant, true, estimated)
    return [[line.get_xydata() for line in moment.lines] for moment in panel.child_axes]


def test_outputs_that_are_thinned_apart_and_an_estimate_with_gaps_are_of_the_same_moment() -> None:
    angles = [0.1 + 0.001 * place * TIMES_S + 0.1 * np.sin(0.7 * place * TIMES_S) for place in range(3)]
    known = (TIMES_S < 90.0) | ((TIMES_S > 110.0) & (TIMES_S < 350.0))
    true = [curve_of(TIMES_S, one) for one in angles]
    assert len({len(times) for times, _ in true}) > 1, "no test: all are thinned alike"
    moments = drawn(HELICOPTER_SIGNALS, true, [curve_of(TIMES_S[known], one[known]) for one in angles])
    count = len(helicopter_lines(0.0, 0.0, 0.0))
    at_s = (np.arange(MOMENTS) + 0.5) / MOMENTS * TIMES_S[-1]
    for time_s, lines in zip(at_s, moments, strict=True):
        is_known = time_s < 90.0 or 110.0 < time_s < 350.0
        assert len(lines) == (2 * count if is_known else count)
        pose = helicopter_lines(*(np.interp(time_s, TIMES_S, one) for one in angles))
        for line, expected in zip(lines, pose * 2, strict=False):
            np.testing.assert_allclose(line, expected, atol=0.03)


@pytest.mark.parametrize(("unit", "value"), [("rad", 0.5), ("deg", np.degrees(0.5))])
def test_a_pendulum_leans_by_its_angle_in_any_unit(unit: str, value: float) -> None:
    plant = replace(PENDULUM_SIGNALS, outputs=(replace(PENDULUM_SIGNALS.outputs[0], unit=unit),))
    curve = curve_of(TIMES_S[:600], np.full(600, value))
    assert has_poses(plant)
    for lines in drawn(plant, [curve], [curve]):
        np.testing.assert_allclose(lines[0], pendulum_lines(0.5)[0])


def test_an_output_that_is_no_angle_has_no_poses() -> None:
    outputs = (replace(PENDULUM_SIGNALS.outputs[0], unit="V"),)
    assert not has_poses(replace(PENDULUM_SIGNALS, outputs=outputs))
