from __future__ import annotations

from tenbaud.flight.summary import joined


def test_when_both_ends_counted_alike_things_then_the_summary_has_the_sum() -> None:
    transmitter = {
        "samples": 30,
        "malformed": 1,
        "reconnects": 1,
        "out_of_bounds": 2,
        "link_dropped": {"COBS": 2},
    }
    receiver = {
        "samples": 29,
        "malformed": 2,
        "reconnects": 0,
        "out_of_bounds": 3,
        "link_dropped": {"COBS": 1, "stray zero": 4},
        "connections_refused": {"no certificate": 1},
        "symbols_late": 3,
    }
    summary = joined(transmitter, receiver)
    assert summary["samples"] == 30
    assert (summary["malformed"], summary["reconnects"], summary["symbols_late"]) == (3, 1, 3)
    assert summary["out_of_bounds"] == 5
    assert summary["link_dropped"] == {"COBS": 3, "stray zero": 4}
    assert summary["connections_refused"] == {"no certificate": 1}
