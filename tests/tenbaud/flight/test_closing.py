"""The lines that end a flight on a terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tenbaud.flight.report import closing_lines
from tenbaud.recording.folder import RunFolder
from tenbaud.sentences.flown import warnings_of
from tests.tenbaud.flown import flown

FLOWN: dict[str, Any] = {
    "preset": "tuned-10baud",
    "plant": "pitch",
    "link": "zenoh",
    "clock": "virtual",
    "outcome": "the flight is over",
    "exit_code": 0,
    "duration_s": 100.0,
    "samples": 1000,
    "coder_bits_up": 1000.0,
    "wire_bytes_up": 15084,
    "wire_bytes_down": 164873,
    "erasures": 0,
    "symbols_late": 0,
    "rejoins": 0,
    "rejoin_bytes": 0,
    "digest_checks": 1000,
    "desyncs": 0,
    "window_start_s": 25.0,
    "outputs": {
        "pitch": {
            "unit": "rad",
            "largest": 2.254,
            "error_live_max": 0.0197547,
            "error_live_rms": 0.0067732,
            "tracking_rms": 0.8536,
        }
    },
    "ticks_commanded": 10000,
}


def lines_of(tmp_path: Path, **changes: Any) -> list[str]:
    return closing_lines(FLOWN | changes, RunFolder(tmp_path))


def test_a_good_flight_is_its_verdict_and_six_lines(tmp_path: Path) -> None:
    lines = lines_of(tmp_path)
    assert lines[0] == "✓ Flight finished: 100 s, both codecs equal in 1000 of 1000 checks"
    assert len(lines) == 1 + 6
    text = "\n".join(lines)
    assert "1000 bits, 10 bit/s" in text
    assert "0.39° rms, 1.13° max (0.30% and 0.88% of the largest), after the first 25 s" in text
    assert "0 words lost, 0 late, 0 resyncs" in text
    assert "rad" not in text
    assert lines[-1].endswith(f"Next: tenbaud replay {tmp_path}")


def test_a_downlink_that_is_not_full_says_its_bits(tmp_path: Path) -> None:
    changed = {"downlink": "compact", "coder_bits_down": 128_000, "duration_s": 100.0}
    lines = closing_lines(FLOWN | changed, RunFolder(tmp_path))
    assert "  Downlink        compact: 128000 bits, 1280 bit/s" in lines


def test_a_narrow_downlink_says_both_rates_and_how_certain_the_lockstep_was(tmp_path: Path) -> None:
    narrow = {
        "scheme": "mirrored",
        "symbols_per_s_asked": 20.0,
        "samples_confirmed": 992,
        "confirmed_after_median": 9,
        "confirmed_after_max": 17,
        "hash_bits_per_sample": 1.75,
    }
    changed = {"downlink": "narrow", "coder_bits_down": 2000, "narrow": narrow, "baud_configured": 10.0}
    lines = lines_of(tmp_path, **changed, duration_s=100.0)
    verdict = "✓ Flight finished: 100 s (10 bit/s up, 20 down), 992 of 1000 samples confirmed"
    assert lines[0] == verdict
    text = "\n".join(lines)
    assert "narrow: 2000 bits, 20 bit/s; set-points only, the law runs beside the plant as well" in text
    assert "certain after 9 samples (median), 17 at most" in text
    assert "a difference stays unseen for n samples with probability 2^(-1.8 n)" in text


def test_the_usual_loop_stands_beside_the_tracking_error(tmp_path: Path) -> None:
    lines = lines_of(tmp_path, usual_loop={"tracking_rms_rad": 0.84976})
    assert lines[4].startswith("  Tracking error  48.9° rms (48.7° over 1000 bit/s), steps of")


def test_a_flight_that_did_not_fly_says_in_what_and_then_its_numbers(tmp_path: Path) -> None:
    lines = lines_of(tmp_path, exit_code=7, not_flown=["the plant fell"], outcome="of 9 samples\nhelp")
    assert lines[0] == "✗ Flight failed (exit code 7): the plant fell"
    assert lines[1:3] == ["  ⚠ of 9 samples", "  ⚠ help"]


def test_a_flight_that_was_stopped_is_neither_finished_nor_failed(tmp_path: Path) -> None:
    first = lines_of(tmp_path, exit_code=130, outcome="stopped by the user")[0]
    assert first.startswith("■ Flight stopped after 100 s: stopped by the user")


def test_an_input_at_its_limit_and_a_lost_estimate_are_warned_of(tmp_path: Path) -> None:
    lost = {"pitch": {"unit": "rad", "largest": 0.1, "tracking_rms": None} | dict.fromkeys(
        ("error_live_rms", "error_live_max"), 0.2
    )}  # fmt: skip
    text = "\n".join(lines_of(tmp_path, ticks_at_limit=9000, outputs=lost))
    assert "an input was at its limit for 90% of the flight" in text
    assert "the estimate of pitch is off by 200% of the largest value" in text


@pytest.mark.parametrize("code", [1, 4, 5, 6, 7])
def test_a_flight_that_failed_does_not_say_finished(tmp_path: Path, code: int) -> None:
    first = lines_of(tmp_path, exit_code=code, outcome="what happened")[0]
    assert first == f"✗ Flight failed (exit code {code}): what happened"


def test_a_flight_that_was_stopped_before_its_window_shows_no_figures_of_it(tmp_path: Path) -> None:
    none = dict.fromkeys(("error_live_max", "error_live_rms", "tracking_rms"))
    output = {"unit": "rad", "largest": 0.0, **none}
    text = "\n".join(lines_of(tmp_path, outputs={"pitch": output}))
    assert "None" not in text
    assert "0.000" not in text
    assert "Estimate error" not in text


def test_each_of_several_outputs_has_its_name_and_unit(tmp_path: Path) -> None:
    pitch = FLOWN["outputs"]["pitch"]
    outputs = {"arm_angle": pitch, "place": {**pitch, "unit": "m", "largest": 0.0}}
    text = "\n".join(lines_of(tmp_path, outputs=outputs))
    assert "arm angle: 0.39° rms, 1.13° max (0.30% and 0.88% of the largest), after" in text
    assert "place: 0.00677 m rms, 0.0198 m max, after the first 25 s" in text
    assert "place: 0.854 m rms, steps of the reference" in text


def test_a_receiver_alone_has_no_checks_to_count(tmp_path: Path) -> None:
    receiver = {name: FLOWN[name] for name in ("preset", "link", "clock", "outcome", "exit_code")}
    lines = closing_lines(receiver | {"samples": 600}, RunFolder(tmp_path))
    assert lines[0] == "✓ Flight finished: 600 samples"
    assert "None" not in "\n".join(lines)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bad_commands": 2000}, "controller failed at 2000 ticks"),
        ({"desyncs": 1}, "differences of the two codecs"),
        ({"recording_rows_lost": 7}, "lost 7 rows"),
        ({"sensor_fault": "encoder stuck"}, "encoder stuck"),
        ({"commands_late": 194}, "194 commands came too late"),
        ({"symbols_missing_share": 0.3}, "30.0% of the slots"),
    ],
)
def test_what_went_wrong_is_said_right_below_the_verdict(
    tmp_path: Path, changes: dict[str, Any], said: str
) -> None:
    assert warnings_of(FLOWN) == []
    assert said in lines_of(tmp_path, **changes)[1]


def test_ticks_without_a_command_of_a_narrow_flight_are_not_put_down_to_late_ones() -> None:
    (said,) = warnings_of(FLOWN | {"commands_late": 194, "downlink": "narrow"})
    assert said == "no command for 194 ticks, so the last one was held (too little was certain)"


def test_a_narrow_flight_that_was_too_short_to_be_certain_of_a_sample_says_nothing_of_its_slots(
    tmp_path: Path,
) -> None:
    summary = flown(tmp_path / "run", duration_s=0.9, channel__downlink="narrow").summary
    assert summary["narrow"]["samples_confirmed"] == 0
    assert summary["symbols_missing_share"] is None
    assert not any("of the slots" in said for said in warnings_of(summary))


def test_a_terminal_without_unicode_gets_plain_characters(tmp_path: Path) -> None:
    text = "\n".join(closing_lines(FLOWN | {"bad_commands": 1}, RunFolder(tmp_path), unicode=False))
    assert text.isascii()
