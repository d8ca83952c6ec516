"""Flights between machines made of namespaces, over TLS, with keys made for the test."""

from __future__ import annotations

import os
from pathlib import Path

from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority
from tests.network.namespaces import Lab, Machine
from tests.tenbaud.confirmed import PATIENT, Summary
from tests.tenbaud.ends import End, wait_for
from tests.tenbaud.processes import REPOSITORY

RIG_AT, DESK_AT, HUB_AT = "10.77.1.1", "10.77.1.2", "10.77.1.9"
PORT = 7447


def at(host: str) -> str:
    return f"tls/{host}:{PORT}"


def make_keys(folder: Path, desk_hosts: tuple[str, ...] = (DESK_AT,)) -> Path:
    """Make an authority with rig, desk, a spare receiver and an uninvited node; return its folder."""
    keys = folder / "keys"
    create_authority(keys)
    add_node(keys, "rig", NodeRole.TRANSMITTER, ())
    add_node(keys, "desk", NodeRole.RECEIVER, desk_hosts)
    add_node(keys, "intern", NodeRole.TRANSMITTER, ())
    return keys


class Flight:
    """A receiver on one machine and a transmitter on another, as processes."""

    def __init__(
        self,
        folder: Path,
        rig: Machine,
        desk: Machine,
        *,
        rig_link: list[str],
        desk_link: list[str],
        duration_s: float = 3600.0,
        settings: tuple[str, ...] = PATIENT,
    ) -> None:
        shared = ["--set", "link.peer_timeout_s=30", *settings]
        self.desk = End("receive", desk_link, folder / "desk", *shared, prefix=desk.prefix, draws=False)
        self.rig = End(
            "transmit",
            rig_link,
            folder / "rig",
            *shared,
            "--duration",
            str(duration_s),
            prefix=rig.prefix,
            draws=False,
        )

    def wait_until_flying(self) -> None:
        """Return when a sample was flown after this call."""
        before = self.desk.status.get("time_s")
        wait_for(
            lambda: (
                self.rig.flies and self.desk.flies and self.desk.status.get("time_s") not in (before,)
            ),
            lambda: f"{self.rig.status} {self.rig.said} {self.desk.status} {self.desk.said}",
        )

    def ended(self) -> tuple[Summary, Summary]:
        """Wait for the planned end; return both summaries, (rig, desk)."""
        (rig_code, rig), (desk_code, desk) = self.rig.ended(), self.desk.ended()
        assert (rig_code, desk_code) == (0, 0), (rig["outcome"], desk["outcome"], self.rig.said)
        return rig, desk

    def stopped(self) -> tuple[Summary, Summary]:
        """Interrupt the transmitter; return both summaries, (rig, desk)."""
        _, rig = self.rig.stop_politely()
        _, desk = self.desk.ended()
        return rig, desk

    def close(self) -> None:
        for end in (self.rig, self.desk):
            if end.process.poll() is None:
                end.kill()

    def __enter__(self) -> Flight:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def tls_links(keys: Path, desk_at: str = DESK_AT) -> dict[str, list[str]]:
    """Return the link options of both ends of a direct flight."""
    return {
        "rig_link": ["--keys", str(keys / "rig"), "--peer", "desk", "--connect", at(desk_at)],
        "desk_link": ["--keys", str(keys / "desk"), "--peer", "rig", "--listen", f"tls/0.0.0.0:{PORT}"],
    }


def environment() -> dict[str, str]:
    """Return an environment in which the package is found."""
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path, "COLUMNS": "200"}


def two_machines(lab: Lab) -> tuple[Machine, Machine]:
    return lab.machine("rig"), lab.machine("desk")
