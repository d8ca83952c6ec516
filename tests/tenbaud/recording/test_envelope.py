from __future__ import annotations

import itertools

import numpy as np
import pytest

from tenbaud.recording.envelope import POINTS, Envelope, Means, thin


def test_curve_is_interrupted_where_rows_are_missing() -> None:
    for pieces in ([6], [2, 1, 3], [3, 3]):
        curve = Envelope()
        times = np.array([0.0, 0.1, 0.2, 1.5, 1.6, 1.7])
        for part in np.split(times, np.cumsum(pieces)[:-1]):
            curve.add(part, np.ones(len(part)))
        new_times, values = curve.curve()
        assert np.isnan(values).tolist() == [False, False, False, True, False, False, False]
        assert new_times == pytest.approx([0.0, 0.1, 0.2, 0.2, 1.5, 1.6, 1.7])


def test_thinned_curve_keeps_its_peaks_its_order_and_its_gaps() -> None:
    times = np.arange(100_000.0)
    values = np.sin(times / 5000.0)
    values[31_234], values[77_777] = 9.0, -9.0
    values[50_000:51_000] = np.nan
    thin_times, thin_values = thin(times, values, 4000)
    assert 2000 <= len(thin_values) <= 4002
    assert (np.diff(thin_times) > 0).all()
    assert thin_values[thin_times == 31_234.0] == 9.0
    assert thin_values[thin_times == 77_777.0] == -9.0
    gap = (thin_times >= 50_050) & (thin_times < 50_950)
    assert gap.any()
    assert np.isnan(thin_values[gap]).all()
    short = (times[:10], values[:10])
    assert thin(*short, 4000) == short


@pytest.mark.parametrize("seed", range(3))
def test_a_curve_in_pieces_has_the_extremes_of_the_whole_one(seed: int) -> None:
    noise = np.random.default_rng(seed)
    times = np.arange(300_000) * 0.01
    values = np.cumsum(noise.normal(size=len(times)))
    values[noise.integers(0, len(times), 40)] = np.nan
    curve = Envelope()
    at = 0
    while at < len(times):
        size = int(noise.integers(1, 6000))
        curve.add(times[at : at + size], values[at : at + size])
        at += size
        assert len(curve.points()[0]) <= 4 * POINTS + size
    kept_times, kept = curve.curve()
    assert len(kept) <= 1.5 * POINTS + 3
    assert (np.diff(kept_times) > 0).all()
    # Against the definition: lowest and highest of every stretch of the final width.
    width = 2.0 ** np.ceil(np.log2((times[-1] - times[0]) / (POINTS // 2)))
    for stretch in range(int(times[-1] / width) + 1):
        span = [stretch * width, (stretch + 1) * width]
        inside = slice(*np.searchsorted(times, span))
        drawn = slice(*np.searchsorted(kept_times, span))
        assert np.nanmin(kept[drawn]) == np.nanmin(values[inside])
        assert np.nanmax(kept[drawn]) == np.nanmax(values[inside])
        assert np.isnan(kept[drawn]).any() == np.isnan(values[inside]).any()


def test_means_are_those_of_all_values_and_an_erased_one_does_not_count() -> None:
    noise = np.random.default_rng(7)
    times = np.arange(50_000) * 0.1
    values = noise.choice([-1.0, 1.0, np.nan], size=len(times))
    means = Means(1000)
    for part_times, part in zip(np.split(times, 100), np.split(values, 100), strict=True):
        means.add(part_times, part)
    starts, found = means.curve()
    assert means.thinned
    assert len(found) <= 1001
    edges = np.searchsorted(times, [*starts, np.inf])
    expected = [np.nanmean(values[a:b]) for a, b in itertools.pairwise(edges)]
    assert found == pytest.approx(expected)
    few = Means(1000)
    few.add(times[:5], values[:5])
    assert not few.thinned
