"""The figures of a run: how well each output was estimated, how well it followed, what that took."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import numpy as np

from tenbaud.recording.signals import output_name
from tenbaud.recording.steps import Step, steps_of
from tenbaud.recording.table import Series

if TYPE_CHECKING:
    from tenbaud.recording.recorded import RecordedRun


class OutputMetrics(TypedDict):
    """The figures of one output, in its `unit`; None where the run does not know them."""

    unit: str
    error_live_rms: float | None
    """of the receiver's estimate at the moment of the command"""
    error_live_max: float | None
    error_coded_rms: float | None
    """of the codec's estimate, as in the paper"""
    error_coded_max: float | None
    tracking_rms: float | None
    """set-point less output, the steps themselves included"""
    steps: list[Step]
    """the responses to steps of the set-point, those before `from_s` included"""


class RunMetrics(TypedDict):
    """The figures of a run; None where it does not know them."""

    from_s: float
    to_s: float
    """the errors are those of the ticks from `from_s` up to here"""
    bits: float | None
    """sent up in the whole flight, without framing"""
    rate_bit_per_s: float | None
    erasures: int | None
    """words of the whole flight that were lost"""
    desyncs: int | None
    rms_over_floor: float | None
    """rms error over the least that any code of this rate can have (`tenbaud floor`)"""
    outputs: dict[str, OutputMetrics]


def metrics_of(run: RecordedRun, span_s: tuple[float | None, float | None], band: float) -> RunMetrics:
    """Return the figures of a run; `span_s` as for `Run.metrics`."""
    summary, times_s = run.summary, run.time_s
    start_s, end_s = span_s
    if start_s is None:
        start_s = float(summary.get("window_start_s") or 0.0)
    end_s = float(times_s[-1]) if end_s is None else end_s
    bits, duration_s = summary.get("coder_bits_up"), summary.get("duration_s")
    # Flight time is a product: the window begins at the tick nearest to it.
    half_tick_s = run.base.tick_s / 2.0
    inside = (times_s > start_s - half_tick_s) & (times_s < end_s + half_tick_s)
    return {
        "from_s": start_s,
        "to_s": end_s,
        "bits": bits,
        "rate_bit_per_s": bits / duration_s if bits is not None and duration_s else None,
        "erasures": summary.get("erasures"),
        "desyncs": summary.get("desyncs"),
        "rms_over_floor": summary.get("rms_over_floor"),
        "outputs": {
            one.name: _output(run, place, inside, times_s < end_s + half_tick_s, band)
            for place, one in enumerate(run.plant.outputs)
        },
    }


def _output(
    run: RecordedRun, place: int, inside: np.ndarray, so_far: np.ndarray, band: float
) -> OutputMetrics:
    def found(what: str) -> Series | None:
        signal = run.signal(output_name(run.plant, what, place))
        return None if signal is None else signal.values

    value, reference = found(""), found("reference")
    live, coded = (_sizes(found(f"error_{kind}"), inside) for kind in ("live", "coded"))
    tracking_rms, steps = None, list[Step]()
    if value is not None and reference is not None:
        tracking_rms, _ = _sizes(reference - value, inside)
        steps = steps_of(run.time_s[so_far], reference[so_far], value[so_far], band)
    return {
        "unit": run.plant.outputs[place].unit,
        "error_live_rms": live[0],
        "error_live_max": live[1],
        "error_coded_rms": coded[0],
        "error_coded_max": coded[1],
        "tracking_rms": tracking_rms,
        "steps": steps,
    }


def _sizes(errors: Series | None, inside: np.ndarray) -> tuple[float | None, float | None]:
    """Return rms and largest size of the errors that are known; None without any."""
    known = np.zeros(0) if errors is None else errors[inside & ~np.isnan(errors)]
    if not len(known):
        return None, None
    return float(np.sqrt(np.mean(known * known))), float(np.abs(known).max())
