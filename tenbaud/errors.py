"""The errors of tenbaud. Each is a `TenbaudError`; its text gives the cause and the next step.

A bad argument is a plain ValueError that names the value and the allowed range.
"""

from __future__ import annotations

from channel.errors import CodecDiverged, ConfigMismatch, LinkError, LinkLost, TenbaudError
from tenbaud.build.parts import PartError
from tenbaud.config.load import ConfigError
from tenbaud.flight.fly import FlightFailed
from tenbaud.recording.errors import RecordingError

__all__ = [
    "CodecDiverged",
    "ConfigError",
    "ConfigMismatch",
    "FlightFailed",
    "LinkError",
    "LinkLost",
    "PartError",
    "RecordingError",
    "TenbaudError",
]
