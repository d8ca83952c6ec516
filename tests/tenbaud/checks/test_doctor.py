from __future__ import annotations

import socket

import pytest

from tenbaud.build.flight import agree
from tenbaud.checks.doctor import examine, narrow_downlink, report, serial_line
from tenbaud.config.load import load_config


def test_a_report_has_everything_and_the_same_probe_as_a_flight() -> None:
    config = load_config()
    findings = examine(config)
    subjects = {finding.subject for finding in findings}
    assert {"tenbaud", "machine", "numerics probe", "clock", "sleep", "Quanser", "Zenoh"} <= subjects
    text = report(findings)
    assert agree(config, "real").identity.numerics_probe.hex() in text
    assert len(text.splitlines()) == len(findings)
    (zenoh,) = [finding for finding in findings if finding.subject == "Zenoh"]
    assert zenoh.state == "ok"
    assert "round trip" in zenoh.text


def test_the_least_rate_of_a_serial_line_is_said_for_each_downlink() -> None:
    found = serial_line(load_config("paper-10baud"))
    assert found.state == "ok"
    rates = "16800 baud full, 1900 baud compact, 200 baud narrow"
    assert f"at least {rates} (channel.downlink)" in found.text


@pytest.mark.parametrize(
    ("preset", "scheme", "state", "words"),
    [
        ("tuned-10baud", "auto", "ok", "a set-point by hand acts 1.5 s after it is given"),
        ("tuned-10baud", "coded", "ok", "commands come down, decided 0.08 s ahead"),
        ("helicopter-10baud", "auto", "note", "change within 1.6 s, the second acts up to 1.6 s late"),
    ],
)
def test_a_narrow_downlink_says_when_set_points_act(
    preset: str, scheme: str, state: str, words: str
) -> None:
    over = {"channel": {"downlink": "narrow"}, "downlink": {"scheme": scheme}}
    (found,) = narrow_downlink(agree(load_config(preset, None, over), "real"))
    assert found.state == state
    assert words in found.text


def test_an_endpoint_is_reached_or_not() -> None:
    with socket.create_server(("127.0.0.1", 0)) as there:
        port = there.getsockname()[1]
        reached = examine(load_config(), (f"tcp/127.0.0.1:{port}",))[-1]
    assert reached.state == "ok"
    refused = examine(load_config(), (f"tcp/127.0.0.1:{port}",))[-1]
    assert refused.state == "problem"
    assert "tenbaud receive" in refused.text
