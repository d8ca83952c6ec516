"""Flights pass their audit as they were recorded: no claim is stricter than the nodes are."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest

from tenbaud.audit.audit import audit
from tenbaud.flight.fly import FlightFailed
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command

ROUGH = "loss=0.2,up:flip=0.05,delay=20ms±10ms,duplicate=0.1,cut=2s+2s"


@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("paper-10baud", {}),
        ("fixed-10baud", {}),
        ("history-10baud", {}),
        ("tuned-10baud", {"link__impairments": ROUGH, "timing__lead_ticks": 30}),
        ("tuned-10baud", {"link__impairments": "loss=0.3,up:flip=0.02"}),
        ("tuned-10baud", {"link__impairments": "delay=150ms±100ms,reorder=0.1"}),
        ("tuned-10baud", {"link__impairments": "burst=0.05/0.3,duplicate=0.2"}),
        ("tuned-10baud", {"link__impairments": "cut=1s+5s", "duration_s": 9.0}),
        ("tuned-10baud", {"link__impairments": "skew=200ppm"}),
        (
            "tuned-20baud",
            {
                "channel__downlink": "narrow",
                "timing__lead_ticks": 0,
                "link__impairments": "cut=5s+4s,loss=0.05,down:delay=120ms",
                "duration_s": 12.0,
                "seed": 0,
            },
        ),
        ("tuned-10baud", {"link__impairments": "step=50ms@3s"}),
        ("usual-1000baud", {"link__impairments": "loss=0.1,delay=20ms±10ms,cut=1s+0.5s"}),
        ("usual-1000baud", {"link__impairments": "loss=0.01,duplicate=0.2"}),
        ("static-10baud", {"link__impairments": "loss=0.1", "channel__delivery": "end"}),
        ("tuned-10baud", {"transmitter__dry_run": True}),
        ("tuned-10baud", {"limits__command_slew_per_s": 5.0, "link__impairments": "loss=0.2"}),
    ],
    ids=lambda value: " ".join(map(str, value.values())) if isinstance(value, dict) else value,
)
def test_a_flight_as_it_was_recorded_passes(
    tmp_path: Path, preset: str, settings: dict[str, object]
) -> None:
    seconds = 2.0 if preset == "usual-1000baud" else 6.0
    with contextlib.suppress(
        FlightFailed
    ):  # some of them arrive nowhere, and are recorded all the same
        flown(tmp_path / "run", preset, **{"duration_s": seconds, **settings})
    result = audit(tmp_path / "run")
    assert result.passed, "\n".join(result.leaks + result.gaps)


def test_a_flight_that_the_guard_ended_passes(tmp_path: Path) -> None:
    with pytest.raises(FlightFailed, match="soft limit"):
        flown(tmp_path / "run", transmitter__soft_limits=0.5)
    result = audit(tmp_path / "run")
    assert result.passed, "\n".join(result.leaks + result.gaps)


@pytest.mark.parametrize(
    "flight",
    [
        ("--impair", ROUGH, "--duration", "6"),
        ("--clock", "real", "--duration", "3", "--impair", "delay=30ms±20ms,loss=0.1"),
        ("--link", "serial", "--duration", "4"),
    ],
    ids=["zenoh, rough", "zenoh, real time", "serial"],
)
def test_two_processes_pass(tmp_path: Path, flight: tuple[str, ...]) -> None:
    start = ("--preset", "tuned-10baud", "--mismatch", "0.1", "--out", "run")
    done = run_command("demo", "--json", *start, *flight, cwd=tmp_path)
    assert done.code == 0, done.err
    result = audit(tmp_path / "run")
    assert result.passed, "\n".join(result.leaks + result.gaps)
