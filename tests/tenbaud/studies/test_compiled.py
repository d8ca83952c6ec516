"""Which sources stand for the figures of a flight."""

from __future__ import annotations

from tenbaud.studies.compiled import BESIDE, figure_sources
from tests.rules.sources import TOP


def test_whatever_turns_a_configuration_into_a_flight_is_among_the_sources() -> None:
    found = figure_sources()
    for name in (
        "channel/codec/coders/zoom.py",
        "tenbaud/build/codec.py",
        "tenbaud/config/schema.py",
        "tenbaud/flight/transmit.py",
        "tenbaud/studies/kernel.py",
        "transmitter/metrics/scores.py",
    ):
        assert TOP / name in found, f"results would outlive a change of {name}"
    assert len(found) == len(set(found))


def test_what_is_left_out_is_there_and_only_draws_or_keeps_results() -> None:
    for name in BESIDE:
        assert (TOP / name).is_file()
        assert TOP / name not in figure_sources()
