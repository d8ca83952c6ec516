"""The arrays of a flight without a count of their owners; see `bare`."""

from __future__ import annotations

from tenbaud.studies.bare import bare
from tenbaud.studies.flight_data import Given, Work


def bare_given(given: Given) -> Given:
    """Return what a flight reads, uncounted."""
    return Given(
        bare(given.start),
        bare(given.alphabet),
        bare(given.shifts),
        bare(given.known),
        bare(given.late),
        bare(given.scored),
        bare(given.reference),
        bare(given.torque),
        bare(given.counts),
        bare(given.commands),
        bare(given.applied),
    )


def bare_work(work: Work) -> Work:
    """Return what a flight writes, uncounted."""
    return Work(
        bare(work.models),
        bare(work.coders),
        bare(work.sent),
        bare(work.word),
        bare(work.model),
        bare(work.coder),
        bare(work.spare),
        bare(work.correction),
        bare(work.nothing),
        bare(work.coded),
        bare(work.live),
        bare(work.front),
        bare(work.rear),
        bare(work.applied),
    )
