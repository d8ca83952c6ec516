"""Telemetry that cannot be had: missed by itself, refused where it was asked for."""

from __future__ import annotations

from tempfile import TemporaryDirectory
from typing import Any

import pytest

from channel.errors import LinkError
from channel.links.zenoh.telemetry import TelemetryPort
from tenbaud import MemoryRecorder
from tenbaud.telemetry.end import TelemetryEnd, TelemetryOptions
from tenbaud.telemetry.place import endpoint_for
from tests.tenbaud.room import agreement


class Silent:
    skipped = 0

    def compose(self) -> dict[str, Any]:
        return {}


def telemetry_end(options: TelemetryOptions) -> TelemetryEnd:
    return TelemetryEnd(agreement(), "receiver", MemoryRecorder(), options, {})  # type: ignore[arg-type]


def test_when_the_usual_place_is_taken_then_the_flight_goes_on_without(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    # Not tmp_path, which may be too long for a socket's name.
    folder = TemporaryDirectory()
    request.addfinalizer(folder.cleanup)
    monkeypatch.setenv("XDG_RUNTIME_DIR", folder.name)
    monkeypatch.setattr("secrets.token_hex", lambda _: "same")
    usual = endpoint_for("", "receiver")
    assert usual is not None
    taken = TelemetryPort("receiver", "another", usual)
    try:
        unasked = telemetry_end(TelemetryOptions())
        with unasked.publishing(lambda _: Silent()):
            assert unasked.summary() == {"telemetry": "off"}
        assert "no telemetry" in capsys.readouterr().err
        with (
            pytest.raises(LinkError),
            telemetry_end(TelemetryOptions("on")).publishing(lambda _: Silent()),
        ):
            pass
    finally:
        taken.close()
