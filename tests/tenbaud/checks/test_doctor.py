from __future__ import annotations

import socket

from tenbaud.build.flight import agree
from tenbaud.checks.doctor import examine, report, serial_line
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


def test_an_endpoint_is_reached_or_not() -> None:
    with socket.create_server(("127.0.0.1", 0)) as there:
        port = there.getsockname()[1]
        reached = examine(load_config(), (f"tcp/127.0.0.1:{port}",))[-1]
    assert reached.state == "ok"
    refused = examine(load_config(), (f"tcp/127.0.0.1:{port}",))[-1]
    assert refused.state == "problem"
    assert "tenbaud receive" in refused.text
