from __future__ import annotations

from transmitter.rigs.formats.samples import RawSample, Timeline, Wraps

MS = 1_000_000


def line(*samples: tuple[int, int | None, int | None]) -> tuple[Timeline, list[tuple[float, bool]]]:
    """Place samples of (host ms, sequence, device us); return elapsed time and restart of each."""
    timeline = Timeline(Wraps())
    placed = [
        timeline.take(RawSample((0,), sequence, device_us), host_ms * MS)
        for host_ms, sequence, device_us in samples
    ]
    return timeline, [(round(one.elapsed_s, 6), one.restarted) for one in placed]


def test_sequence_and_time_wrap() -> None:
    timeline, placed = line(
        (0, 65_534, 2**32 - 3000), (2, 65_535, 2**32 - 1000), (4, 0, 1000), (6, 1, 3000)
    )
    assert placed[1:] == [(0.002, False)] * 3
    assert timeline.counts == {"samples": 4, "lost": 0}


def test_gaps_and_repeats_are_counted() -> None:
    timeline, _ = line((0, 10, 0), (2, 11, 2000), (10, 15, 10_000), (12, 15, 12_000))
    assert timeline.counts == {"samples": 4, "lost": 3, "repeated": 1}


def test_a_device_that_begins_anew_is_noticed() -> None:
    assert line((0, 500, 10**6), (2000, 1, 2000))[1][1][1], "both counters went back"
    assert line((0, None, 10**6), (2000, None, 2000))[1][1][1], "time alone"
    assert line((0, 500, None), (2000, 1, None))[1][1][1], "sequence alone"


def test_a_clock_that_is_far_ahead_of_ours_was_set_anew() -> None:
    """After 35 minutes a restart looks like a step forward to the counters alone."""
    hour = 3600 * 10**6
    timeline, placed = line((0, 60_000, hour), (2000, 1, 2000))
    assert placed[1][1]
    assert timeline.counts["restarts"] == 1


def test_a_held_up_reader_sees_no_restart() -> None:
    """Samples that waited in a buffer come at once; the device's clock still spaces them."""
    timeline, placed = line((0, 1, 0), (3000, 2, 2000), (3000, 3, 4000), (3000, 1500, 3_000_000))
    assert placed[1:] == [(0.002, False), (0.002, False), (2.996, False)]
    assert timeline.counts["lost"] == 1496


def test_without_a_device_clock_ours_is_used() -> None:
    _, placed = line((0, None, None), (7, None, None))
    assert placed[1] == (0.007, False)
