"""The form of a `summary.json`, as far as verdict, figures and metrics read it."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, ValidationError


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False)


class _Learned(_Part):
    error: float
    deviation: float


class _UsualLoop(_Part):
    tracking_rms_rad: float


class _Output(_Part):
    unit: str
    largest: float
    error_live_rms: float | None
    error_live_max: float | None
    tracking_rms: float | None


class _Summary(_Part):
    exit_code: int
    outcome: str
    samples: int
    preset: str | None = None
    plant: str | None = None
    not_flown: list[str] | None = None
    duration_s: float | None = None
    window_start_s: float | None = None
    coder_bits_up: float | None = None
    coder_bits_down: float | None = None
    wire_bytes_up: int | None = None
    wire_bytes_down: int | None = None
    ticks_commanded: int | None = None
    commands_late: int | None = None
    symbols_missing_share: float | None = None
    erasures: int | None = None
    desyncs: int | None = None
    rejoins: int | None = None
    reconnects: int | None = None
    rms_over_floor: float | None = None
    loop_late_ms_p50: float | None = None
    loop_late_ms_p99: float | None = None
    usual_loop: _UsualLoop | None = None
    learned: dict[str, _Learned] | None = None
    outputs: dict[str, _Output] | None = None


def is_summary(given: object) -> bool:
    """Return whether a value read from a file has the form of a flight's summary."""
    try:
        _Summary.model_validate(given)
    except ValidationError:
        return False
    return True
