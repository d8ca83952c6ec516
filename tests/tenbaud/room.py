"""A receiver of many rigs with its lines in memory, and transmitters that fly against it one by one."""

from __future__ import annotations

import math
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Self

from channel.protocol.endings import End, Ending
from channel.protocol.frames import Frame
from channel.protocol.wire import decode, encode
from receiver.loops.many import ManyService
from tenbaud.build.ends import build_observer
from tenbaud.build.flight import Agreement, agree
from tenbaud.config.load import load_config
from tenbaud.flight.many import ManyHost
from transmitter.session.session import Phase, TransmitterSession

PATIENCE_S = 20.0
UNHURRIED = {"channel": {"deadline_allowance_s": 6.0}}
"""No slot is erased because the machine was busy."""


def agreement(preset: str | None = None, **changes: Any) -> Agreement:
    return agree(load_config(preset, None, {**UNHURRIED, **changes}), "real")


class MemoryHub:
    """Carries messages within this process."""

    def __init__(self) -> None:
        self.up: SimpleQueue[tuple[str, bytes] | None] = SimpleQueue()
        self.down: dict[str, SimpleQueue[bytes]] = defaultdict(SimpleQueue)
        self.joined: set[str] = set()

    def receive(self, timeout_s: float) -> tuple[str, bytes] | None:
        try:
            return self.up.get(timeout_s > 0.0, timeout_s or None)
        except Empty:
            return None

    def send(self, name: str, data: bytes) -> None:
        self.down[name].put(data)

    def wake(self) -> None:
        self.up.put(None)

    def join(self, name: str) -> None:
        self.joined.add(name)

    def leave(self, name: str) -> None:
        self.joined.discard(name)


class Room:
    """Within a `with`, serves; afterwards `host.summaries` has every flight."""

    def __init__(
        self,
        root: Path,
        agreement_of: Callable[[str], Agreement] | None = None,
        rigs_max: int = 10,
    ) -> None:
        self.hub = MemoryHub()
        self.told: list[str] = []
        common = agreement()
        self.host = ManyHost(
            self.hub,  # type: ignore[arg-type]
            agreement_of or (lambda _: common),
            root,
            rigs_max,
            self.told.append,
        )
        self.service = ManyService(self.hub, self.host)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self.service.run, args=(self._stop.is_set,))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.host.close()

    def summary(self, name: str) -> dict[str, Any]:
        """Return the summary of a session's last flight."""
        return [one for one in self.host.summaries if one["session"] == name][-1]

    def until_ended(self, flights: int) -> None:
        give_up_s = time.monotonic() + PATIENCE_S
        while len(self.host.summaries) < flights:
            assert time.monotonic() < give_up_s, self.told
            time.sleep(0.01)


class Rig:
    """A transmitter whose slots come one after the other as fast as they are answered."""

    def __init__(self, room: Room, name: str, incarnation: int = 1, **changes: Any) -> None:
        agreed = agreement(**changes)
        self.name = name
        self.hub = room.hub
        self.terms = agreed.terms
        self.session = TransmitterSession(
            agreed.codec,
            agreed.terms,
            agreed.identity,
            incarnation,
            state_observer=build_observer(agreed),
        )
        self._tick = 0

    def put(self, data: bytes) -> None:
        self.hub.up.put((self.name, data))

    def hear(self, timeout_s: float = PATIENCE_S) -> Frame:
        frame = decode(self.hub.down[self.name].get(True, timeout_s))
        for answer in self.session.on_frame(frame):
            self.put(encode(answer))
        return frame

    def greet(self) -> Self:
        """Ask until there is a session or a refusal."""
        give_up_s = time.monotonic() + PATIENCE_S
        while self.session.phase is Phase.GREETING and self.session.refusal is None:
            assert time.monotonic() < give_up_s, f"{self.name} was never answered"
            self.put(encode(self.session.hello()))
            try:
                self.hear(0.1)
            except Empty:
                continue
        return self

    def fly(self, samples: int) -> Self:
        """Fly `samples` more samples, each confirmed before the next; rejoins on the way are made."""
        wanted = self.session.counts["digest_checks"] + samples
        give_up_s = time.monotonic() + PATIENCE_S
        while self.session.counts["digest_checks"] < wanted:
            assert time.monotonic() < give_up_s, f"{self.name}: {self.session.phase}"
            self._tick = max(self._tick, self.session.epoch_tick)
            measured = (0.4 * math.sin(0.01 * self._tick),) * len(self.terms.signals.outputs)
            for frame in self.session.on_measurement(self._tick, measured):
                self.put(encode(frame))
            self._tick += 1
            self.session.command(self._tick)
            while self.session.lag_samples and self.session.phase is Phase.FLYING:
                self.hear()
            if self.session.phase is Phase.REJOINING:
                self.hear()
        return self

    def bye(self) -> None:
        for frame in self.session.bye(End(Ending.OVER, "the flight is over")):
            self.put(encode(frame))
