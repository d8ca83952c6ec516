"""The compact downlink as users configure it: presets, both ends' agreement, recordings, line rates."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from channel.links.serial.budget import usual_rate_baud
from channel.protocol.frames import Refuse
from channel.protocol.wire import DATAGRAM
from tenbaud.audit.audit import audit
from tenbaud.build.ends import build_receiver, build_transmitter
from tenbaud.build.flight import agree
from tenbaud.checks.doctor import line_rates
from tenbaud.config.load import load_config, preset_names
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.rules.sources import TOP
from tests.tenbaud.flown import flown

COMPACT = {"channel__downlink": "compact"}


@pytest.mark.parametrize(
    ("preset", "seconds", "frame_bytes"),
    [
        ("paper-10baud", 5.0, 16),
        ("tuned-10baud", 5.0, 16),
        ("helicopter-10baud", 3.0, 16),
        ("pendulum-16baud", 4.0, 12),
        ("heading-1baud", 30.0, 12),
    ],
)
def test_presets_fly_with_it_and_their_recordings_pass(
    tmp_path: Path, preset: str, seconds: float, frame_bytes: int
) -> None:
    run = flown(tmp_path / "run", preset, duration_s=seconds, **COMPACT)
    summary = run.summary
    assert summary["exit_code"] == 0, summary["outcome"]
    assert (summary["downlink"], summary["desyncs"], summary["rejoins"]) == ("compact", 0, 0)
    assert summary["coder_bits_down"] == 8 * frame_bytes * summary["samples"]
    result = audit(run.path)
    assert result.passed, result.leaks + result.gaps


def test_a_rough_flight_is_audited_and_flown_again(tmp_path: Path) -> None:
    faults = "loss=0.1,up:flip=0.05,delay=20ms±10ms,duplicate=0.1,cut=4s+3s"
    run = flown(tmp_path / "run", link__impairments=faults, **COMPACT)
    assert run.summary["rejoins"] >= 1
    assert run.summary["digest_checks"] < run.summary["samples"]
    result = audit(run.path)
    assert result.passed, result.leaks + result.gaps
    again = replay(load_record(run.path))
    assert again.equal, again.differences


@pytest.mark.parametrize(("up", "down"), [("compact", "full"), ("full", "compact")])
def test_an_end_with_the_other_downlink_is_refused_with_both_values(up: str, down: str) -> None:
    ours, theirs = (
        agree(load_config("paper-10baud", None, {"channel": {"downlink": one}}), "virtual")
        for one in (up, down)
    )
    session = build_transmitter(ours, None).session
    receiver = build_receiver(theirs, None, DATAGRAM)
    (refusal,) = receiver.session.on_frame(session.hello(), 0)
    assert isinstance(refusal, Refuse)
    session.on_frame(refusal)
    assert session.refusal is not None
    assert f"channel.downlink: here {up}, there {down}" in session.refusal.text


def test_the_full_downlink_has_the_shared_configuration_of_before() -> None:
    shared = load_config("paper-10baud").shared_json(0)
    assert '"downlink"' not in shared
    compact = load_config("paper-10baud", None, {"channel": {"downlink": "compact"}})
    assert '"downlink":"compact"' in compact.shared_json(0)


def test_the_page_on_serial_lines_has_the_least_rate_of_every_preset() -> None:
    page = (TOP / "docs" / "serial.md").read_text(encoding="utf-8")
    found = re.findall(r"^\| `([\w-]+)` \| (\d+) \((\d+)\) \| (\d+) \((\d+)\) \|$", page, re.MULTILINE)
    wanted = []
    for name in preset_names():
        rates = line_rates(load_config(name)).values()
        wanted.append((name, *[str(one) for rate in rates for one in (rate, usual_rate_baud(rate))]))
    assert found == wanted
