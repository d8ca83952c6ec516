"""Many transmitters in one process, without plants: what loads a receiver, at little cost of its own.

Each has a session, a link and a separate Zenoh session, and keeps its slots; only the measurement is
a sine wave, and nothing is recorded. `python -m benchmarks.light_rigs ENDPOINT RIGS SECONDS SHARDS`
prints what they saw as JSON. With SHARDS above 0 the endpoint is a router's, and the names of the rigs
spread them over the receivers.
"""

from __future__ import annotations

import heapq
import json
import math
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass

from channel.line.line import Inlet
from channel.links.zenoh.link import ZenohLink
from channel.protocol.endings import End, Ending
from channel.protocol.wire import encode
from tenbaud.build.flight import Agreement, agree
from tenbaud.config.load import load_config
from transmitter.session.session import Phase, TransmitterSession

NAME = "load"
STARTED_S = 60.0


@dataclass(slots=True)
class LightRig:
    """One transmitter."""

    session: TransmitterSession
    link: ZenohLink
    inlet: Inlet
    start_ns: int = 0

    def take_in(self) -> None:
        """Take what has come."""
        while (data := self.link.receive(0.0)) is not None:
            frame = self.inlet.take(data)
            if frame is not None:
                self.session.on_frame(frame)
        self.session.following.take_confirmed()

    def fly(self, sample: int) -> None:
        """Send one symbol."""
        terms = self.session.terms
        tick = sample * terms.ticks_per_sample
        self.take_in()
        self.session.command(tick)
        angle = 0.8 * math.sin(0.5 * sample * terms.sample_ns / 1e9)
        for frame in self.session.on_measurement(tick, (angle,)):
            self.link.send(encode(frame))

    def end(self) -> None:
        """Take the last echo in and end the flight."""
        self.take_in()
        for frame in self.session.bye(End(Ending.OVER, "the flight is over")):
            self.link.send(encode(frame))


def fly_all(endpoint: str, rigs: int, seconds: float, shards: int = 0) -> dict[str, float]:
    """Fly the given number of rigs for so long, their slots spread over the symbol period."""
    agreement = agree(load_config("tuned-10baud"), "real")
    with ExitStack() as stack:
        fleet = [_greeted(stack, agreement, endpoint, index, shards) for index in range(rigs)]
        period_ns = agreement.terms.sample_ns
        print("flying", flush=True)
        start_ns = time.monotonic_ns() + period_ns
        due = [(start_ns + index * period_ns // rigs, index, 0) for index in range(rigs)]
        heapq.heapify(due)
        latest_ns = 0
        while due:
            due_ns, index, sample = heapq.heappop(due)
            time.sleep(max(0, due_ns - time.monotonic_ns()) / 1e9)
            latest_ns = max(latest_ns, time.monotonic_ns() - due_ns)
            if due_ns < start_ns + seconds * 1e9:
                fleet[index].fly(sample)
                heapq.heappush(due, (due_ns + period_ns, index, sample + 1))
            else:
                fleet[index].end()
        sessions = [rig.session for rig in fleet]
        return {
            "samples": sum(session.next_sample for session in sessions),
            "digest_checks": sum(session.counts["digest_checks"] for session in sessions),
            "desyncs": sum(session.counts["desyncs"] for session in sessions),
            "erasures": sum(session.counts["erasures"] for session in sessions),
            "rejoins": sum(session.counts["rejoins"] for session in sessions),
            "late_ms_max": latest_ns / 1e6,
        }


def session_pattern(shard: int) -> str:
    """Return the pattern of the names that a shard serves."""
    return f"{NAME}/{shard}/*"


def _greeted(
    stack: ExitStack, agreement: Agreement, endpoint: str, index: int, shards: int
) -> LightRig:
    session = TransmitterSession(agreement.codec, agreement.terms, agreement.identity, index + 1)
    if shards:
        name = session_pattern(index % shards).replace("*", str(index))
        link = stack.enter_context(ZenohLink("transmitter", name, router=(endpoint,)))
    else:
        link = stack.enter_context(ZenohLink("transmitter", f"{NAME}/{index}", connect=(endpoint,)))
    rig = LightRig(session, link, Inlet())
    give_up_s = time.monotonic() + STARTED_S
    while session.phase is not Phase.FLYING:
        link.send(encode(session.hello()))
        data = link.receive(0.2)
        frame = None if data is None else rig.inlet.take(data)
        if frame is not None:
            session.on_frame(frame)
        if time.monotonic() > give_up_s:
            raise RuntimeError(f"rig {index} got no session: {session.refusal}")
    return rig


if __name__ == "__main__":
    where, number, duration, parts = sys.argv[1:]
    print(json.dumps(fly_all(where, int(number), float(duration), int(parts))))
