"""The tables of ARCHITECTURE.md name the files that a reading runs through, as a flight shows them."""

from __future__ import annotations

import re
import sys
import threading
from collections import Counter
from types import FrameType

import pytest

from channel.links.endpoints import free_endpoint
from channel.protocol.endings import End, Ending
from receiver.loops.single import serve
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight.ends import Endpoints, open_link
from tenbaud.flight.transmit import prepare
from tests.rules.sources import PACKAGES, TOP
from transmitter.loops.real import RealFlight

FILES_MAX = 20
SAMPLES = 12
GREETED_SAMPLES = 2
"""At the start of the flight, when more runs than in the samples that follow."""


class Trace:
    """Notes in which files a function calls another or is called, sample by sample."""

    def __init__(self) -> None:
        self.samples: list[set[str]] = []

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and self.samples:
            self.samples[-1].add(frame.f_code.co_filename)
            if frame.f_back is not None:
                self.samples[-1].add(frame.f_back.f_code.co_filename)

    def files(self) -> set[str]:
        """Return the product's files that run in most samples: a held-up one may run others."""
        steady = self.samples[GREETED_SAMPLES:]
        seen = Counter(name for sample in steady for name in sample)
        prefix = f"{TOP}/"
        names = [name.removeprefix(prefix) for name, count in seen.items() if 2 * count > len(steady)]
        return {name for name in names if name.split("/")[0] in PACKAGES}


def flown() -> set[str]:
    """Return the files of a sample that is flown over Zenoh on the real clock."""
    config = load_config("paper-10baud", None, {"duration_s": SAMPLES / 10.0})
    agreement = agree(config, "real")
    endpoint = free_endpoint()
    trace = Trace()

    def receive() -> None:
        sys.setprofile(trace)
        with open_link(agreement, "receiver", Endpoints(listen=(endpoint,))) as link:
            serve(build_receiver(agreement, None, link.wire), link, peer_timeout_s=20.0)

    receiver = threading.Thread(target=receive)
    receiver.start()
    with open_link(agreement, "transmitter", Endpoints(connect=(endpoint,))) as link:
        run = prepare(agreement, None, link.wire)
        per_sample = agreement.terms.ticks_per_sample

        def before(tick: int) -> None:
            if tick % per_sample == 0:
                trace.samples.append(set())

        run.node.before_every_tick(before)
        flight = RealFlight(run.endpoint, link, peer_timeout_s=20.0)
        with run.node.rig:
            flight.greet()
            sys.setprofile(trace)
            flight.run(agreement.flight_ticks)
            sys.setprofile(None)
            flight.finish(lambda: End(Ending.OVER))
    receiver.join(20.0)
    return trace.files()


def tables() -> list[list[str]]:
    """Return the files of the two tables of the section."""
    text = (TOP / "docs/ARCHITECTURE.md").read_text(encoding="utf-8")
    section = text.split("## The way of one encoder reading")[1].split("\n## ")[0]
    rows = [re.findall(r"`([\w/]+\.py)`", part) for part in re.findall(r"(?:^\|.*\n)+", section, re.M)]
    assert len(rows) == 2
    return rows


@pytest.mark.real_time
def test_when_a_sample_is_flown_then_it_runs_through_the_files_of_the_tables() -> None:
    way, beside = tables()
    assert len(way) == len(set(way)) <= FILES_MAX
    assert not set(way) & set(beside)
    assert flown() == {*way, *beside}
