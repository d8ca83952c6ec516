"""The compact downlink as users configure it: presets, both ends' agreement, recordings, line rates."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from channel.protocol.compact import CompactForm
from channel.protocol.frames import Echo, Refuse
from channel.protocol.wire import DATAGRAM
from tenbaud.audit.audit import audit
from tenbaud.build.codec import build_codec
from tenbaud.build.ends import build_receiver, build_transmitter
from tenbaud.build.flight import agree, build_terms
from tenbaud.checks.doctor import serial_line
from tenbaud.config.load import ConfigError, load_config, preset_names
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


@pytest.mark.parametrize(("downlink", "slew_per_s"), [("full", 0.09), ("compact", 0.24)])
def test_a_slew_limit_below_a_step_of_the_downlink_is_refused_with_numbers(
    downlink: str, slew_per_s: float
) -> None:
    given = {"channel": {"downlink": downlink}, "limits": {"command_slew_per_s": slew_per_s}}
    with pytest.raises(ConfigError, match=r"limits\.command_slew_per_s to [\d.]+ times"):
        agree(load_config("paper-10baud", None, given), "real")
    step_v = {"full": 0.001, "compact": 0.005}[downlink]
    given["limits"]["command_slew_per_s"] = step_v / 0.01
    agreed = agree(load_config("paper-10baud", None, given), "real")
    if downlink == "compact":
        held = CompactForm(agreed.codec, agreed.terms).held([(5.0, -5.0)] * 10, (0.0, 0.0))
        assert held == (5, -5)


def test_the_full_downlink_has_the_shared_configuration_of_before() -> None:
    shared = load_config("paper-10baud").shared_json(0)
    assert '"downlink"' not in shared
    compact = load_config("paper-10baud", None, {"channel": {"downlink": "compact"}})
    assert '"downlink":"compact"' in compact.shared_json(0)


def carries(preset: str, downlink: str, rate_baud: int) -> bool:
    """Return whether a flight is agreed to on a serial line of this rate."""
    link = {"kind": "serial", "port": "none", "line_rate_baud": rate_baud}
    changes = {"channel": {"downlink": downlink}, "link": link, "timing": {"lead_ticks": "auto"}}
    config = load_config(preset, None, changes)
    try:
        build_terms(config, build_codec(config), "real")
    except ValueError as error:
        assert "serial line cannot carry" in str(error) or "slots of" in str(error)  # noqa: PT017
        return False
    return True


USUAL_RATES_BAUD = (110, 300, 600, 1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400)
"""of serial ports"""


def test_the_page_on_serial_lines_has_the_least_rate_of_every_preset_and_its_frame() -> None:
    page = (TOP / "docs" / "serial.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| (.+) \| (.+) \| (.+) \| (\d+) \|$", page, re.MULTILINE)
    assert [row[0] for row in rows] == list(preset_names())
    for preset, *cells, frame_bytes in rows:
        config = load_config(preset, None, {"channel": {"downlink": "compact"}})
        codec = build_codec(config)
        terms = build_terms(config, codec, "virtual")
        echo = Echo(0, 0, 0, (0,) * (terms.ticks_per_sample * codec.model.input_size))
        frame = CompactForm(codec, terms).packed(1, 0, (echo,))
        assert len(DATAGRAM.encode(frame)) == int(frame_bytes)
        finding = serial_line(load_config(preset))
        for downlink, cell in zip(("full", "compact", "narrow"), cells, strict=True):
            if cell == "none":
                assert not carries(preset, downlink, 10_000_000)
                assert finding.state == "note"
                continue
            least, usual = (int(one) for one in re.findall(r"\d+", cell))
            assert usual == next((rate for rate in USUAL_RATES_BAUD if rate >= least), least)
            assert carries(preset, downlink, least)
            assert not carries(preset, downlink, least - 1)
            assert f"{least} baud {downlink}" in finding.text


def test_a_configuration_that_makes_no_flight_is_a_finding() -> None:
    config = load_config("paper-10baud", None, {"limits": {"command_max": [1.0, 1.0, 1.0]}})
    finding = serial_line(config)
    assert finding.state == "note"
    assert "3 value" in finding.text
