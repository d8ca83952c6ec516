"""Machines made of network namespaces, joined by cables that a test can pull, and removed with it.

Names carry this process' id, so that two runs at once do not meet. Everything is removed by name at the
end; nothing outside the namespaces is changed.
"""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pytest

_COUNTER = itertools.count()
_TUNSETIFF = 0x400454CA
_IFF_TUN_NO_INFO = 0x0001 | 0x1000


def ip(*arguments: str) -> None:
    """Run `ip`; a failure says what it said."""
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"ip {' '.join(arguments)}: {done.stderr.strip()}")


@dataclass(frozen=True)
class Machine:
    """One namespace."""

    name: str

    @property
    def prefix(self) -> list[str]:
        """What to put before a command to run it here."""
        return ["ip", "netns", "exec", self.name]

    def ip(self, *arguments: str) -> None:
        ip("-netns", self.name, *arguments)

    def run(self, *command: str, timeout_s: float = 30.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*self.prefix, *command], capture_output=True, text=True, timeout=timeout_s, check=False
        )


@dataclass(frozen=True)
class Plug:
    """One end of a cable."""

    machine: Machine
    device: str

    def pull(self) -> None:
        self.machine.ip("link", "set", self.device, "down")

    def put_back(self) -> None:
        self.machine.ip("link", "set", self.device, "up")

    def readdress(self, old: str, new: str) -> None:
        # In this order: with the first address of a network the later ones would go too.
        self.machine.ip("addr", "del", f"{old}/24", "dev", self.device)
        self.machine.ip("addr", "add", f"{new}/24", "dev", self.device)

    def limit(self, *tbf: str) -> None:
        """Limit the rate of what leaves here, in the words of `tc ... tbf`."""
        done = self.machine.run("tc", "qdisc", "replace", "dev", self.device, "root", "tbf", *tbf)
        if done.returncode:
            pytest.skip(f"this kernel has no tbf: {done.stderr.strip()}")

    def limited_bytes(self) -> int:
        """Return the bytes that went through the limit."""
        words = self.machine.run("tc", "-s", "qdisc", "show", "dev", self.device).stdout.split()
        return int(words[words.index("Sent") + 1])


class Lab:
    """Within a `with`, machines and cables; skips the test where namespaces are not permitted."""

    def __init__(self) -> None:
        self._stem = f"tb{os.getpid()}-{next(_COUNTER)}"
        self._machines: list[Machine] = []
        self._stack = contextlib.ExitStack()
        self._devices = itertools.count()

    def __enter__(self) -> Self:
        if shutil.which("ip") is None:
            pytest.skip("no `ip` here to make network namespaces with")
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def machine(self, name: str) -> Machine:
        made = Machine(f"{self._stem}-{name}")
        try:
            ip("netns", "add", made.name)
        except RuntimeError as error:
            pytest.skip(f"network namespaces are not permitted here: {error}")
        self._stack.callback(ip, "netns", "del", made.name)
        made.ip("link", "set", "lo", "up")
        return made

    def cable(self, left: Machine, left_at: str, right: Machine, right_at: str) -> tuple[Plug, Plug]:
        """Join two machines by a veth pair; return its two ends."""
        one, other = self._device(), self._device()
        peer = ("peer", "name", other, "netns", right.name)
        ip("link", "add", one, "netns", left.name, "type", "veth", *peer)
        ends = Plug(left, one), Plug(right, other)
        for plug, address in zip(ends, (left_at, right_at), strict=True):
            _configure(plug, address)
        return ends

    def bad_cable(
        self,
        left: Machine,
        left_at: str,
        right: Machine,
        right_at: str,
        *,
        delay_s: float,
        loss: float,
        seed: int = 1,
    ) -> BadCable:
        """Join two machines by a cable that delays every packet and loses some."""
        names = self._device(), self._device()
        tunnels = [_tunnel(name) for name in names]
        for name, tunnel, machine, address in zip(
            names, tunnels, (left, right), (left_at, right_at), strict=True
        ):
            self._stack.callback(os.close, tunnel)
            ip("link", "set", name, "netns", machine.name)
            _configure(Plug(machine, name), address)
        cable = BadCable((tunnels[0], tunnels[1]), delay_s, loss, seed)
        self._stack.callback(cable.close)
        return cable

    def _device(self) -> str:
        return f"tb{os.getpid() % 100_000}x{next(_COUNTER)}{next(self._devices)}"[:15]


def _configure(plug: Plug, address: str) -> None:
    plug.machine.ip("addr", "add", f"{address}/24", "dev", plug.device)
    plug.machine.ip("link", "set", plug.device, "up")


def _tunnel(name: str) -> int:
    try:
        number = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(number, _TUNSETIFF, struct.pack("16sH", name.encode(), _IFF_TUN_NO_INFO))
    except OSError as error:
        pytest.skip(f"no tunnel device to delay and lose packets with: {error}")
    return number


class BadCable:
    """Carries IP packets between two tunnel devices: each one later, some of them never."""

    def __init__(self, ends: tuple[int, int], delay_s: float, loss: float, seed: int) -> None:
        self._ends = ends
        self._delay_s = delay_s
        self.loss = loss
        self._chooser = random.Random(seed)
        self.carried = 0
        self.lost = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        waiting: deque[tuple[float, int, bytes]] = deque()
        near, far = self._ends
        other = {near: far, far: near}
        while not self._stop.is_set():
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, target, packet = waiting.popleft()
                with contextlib.suppress(OSError):
                    os.write(target, packet)
                self.carried += 1
            patience_s = max(0.0, waiting[0][0] - now) if waiting else 0.05
            for source in select.select(self._ends, [], [], patience_s)[0]:
                with contextlib.suppress(OSError):
                    packet = os.read(source, 65_536)
                    if self._chooser.random() < self.loss:
                        self.lost += 1
                    else:
                        waiting.append((time.monotonic() + self._delay_s, other[source], packet))


def copy_keys(keys: Path, names: list[str], target: Path) -> None:
    """Copy nodes' folders as `scp -r` would, modes kept."""
    for name in names:
        shutil.copytree(keys / name, target / name)
