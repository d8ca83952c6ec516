"""A flight in a few lines, from its summary: verdict, warnings, figures. Angles are in degrees."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tenbaud.sentences.exit_codes import ExitCode
from tenbaud.sentences.quantities import in_degrees

Summary = dict[str, Any]

LATE_SHARE_WORTH_A_WARNING = 0.01
LIMITED_SHARE_WORTH_A_WARNING = 0.5
LOST_ERROR_SHARE = 0.5
"""of the largest output: with an rms error beyond it the estimate says little about the plant"""


def verdict_of(summary: Summary, unicode: bool = True) -> str:
    """Return how a flight ended, in one line."""
    code = int(summary["exit_code"])
    if code and code != ExitCode.INTERRUPTED:
        mark = "✗" if unicode else "x"
        cause = ", ".join(summary.get("not_flown") or ()) or summary["outcome"]
        return f"{mark} Flight failed (exit code {code}): {cause}"
    duration_s = summary.get("duration_s")  # a receiver knows samples, and not the flight's time
    flown = f"{summary['samples']} samples" if duration_s is None else f"{float(duration_s):g} s"
    text = f"{'✓' if unicode else '+'} Flight finished: {flown}"
    if code:
        text = f"{'■' if unicode else '='} Flight stopped after {flown}: {summary['outcome']}"
    if summary.get("downlink") == "narrow":
        return text + _both_ways(summary)
    checks, desyncs = summary.get("digest_checks"), summary.get("desyncs") or 0
    if checks is None:
        return text
    if desyncs:
        return f"{text}, {checks} checks of the two codecs, {desyncs} found a difference"
    return f"{text}, both codecs equal in {checks} of {checks} checks"


def _both_ways(summary: Summary) -> str:
    """Return what went both ways, and of how much of it the transmitter is certain."""
    narrow = summary.get("narrow") or {}
    if "symbols_per_s_asked" not in narrow:
        return ""
    rates = f"{summary['baud_configured']:g} bit/s up, {narrow['symbols_per_s_asked']:g} down"
    return f" ({rates}), {narrow['samples_confirmed']} of {summary['samples']} samples confirmed"


def warnings_of(summary: Summary) -> list[str]:
    """Return what a person should know before the figures, most serious first."""
    get = summary.get
    counted = (
        (
            "bad_commands",
            "the controller failed at {} ticks (wrong length, not finite, or an exception)",
        ),
        ("bad_references", "the reference failed at {} ticks"),
        (
            "desyncs",
            "differences of the two codecs, resynchronised: {} (`tenbaud diff` names the field)",
        ),
        ("out_of_bounds", "{} frames with values out of bounds were dropped"),
        ("malformed", "{} messages were no frames and were dropped"),
        ("recording_rows_lost", "the recording lost {} rows: the disk was too slow"),
    )
    found = str(get("outcome")).splitlines() if get("not_flown") else []
    found += [text.format(get(name)) for name, text in counted if get(name)]
    if get("sensor_fault"):
        found.append(f"sensor: {get('sensor_fault')}")
    ticks = get("ticks_commanded")
    if get("ticks_guard_down"):
        found.append(f"the guard held the safe voltage for {get('ticks_guard_down')} ticks")
    late = get("commands_late") or 0
    if ticks and late > LATE_SHARE_WORTH_A_WARNING * ticks:
        narrow = get("downlink") == "narrow"
        found.append(
            f"no command for {late} ticks, so the last one was held (too little was certain)"
            if narrow
            else f"{late} commands came too late, so the last one was held (a lost symbol delays the "
            "command of its sample)"
        )
    at_limit = get("ticks_at_limit") or 0
    if ticks and at_limit > LIMITED_SHARE_WORTH_A_WARNING * ticks:
        found.append(
            f"an input was at its limit for {at_limit / ticks:.0%} of the flight (limits.command_max): "
            "can the plant reach the set-point?"
        )
    missing = get("symbols_missing_share") or 0.0
    if missing > LATE_SHARE_WORTH_A_WARNING:
        found.append(f"{missing:.1%} of the slots had no symbol in time")
    for name, one in (get("outputs") or {}).items():
        rms, largest = one["error_live_rms"], one["largest"]
        if rms is not None and largest and rms > LOST_ERROR_SHARE * largest:
            found.append(
                f"the estimate of {name.replace('_', ' ')} is off by {rms / largest:.0%} of the "
                "largest value: do preset and model fit this plant?"
            )
    return found


def figures_of(summary: Summary, unicode: bool = True) -> Iterator[tuple[str, str]]:
    """Yield the figures that a person looks at first, each as a label and its text."""
    get = summary.get
    flown = f"{get('preset')} over {get('link')}, {get('clock')} clock"
    yield "Flown", f"{get('plant')}; {flown}" if get("plant") else flown
    if get("coder_bits_up") is not None:
        yield "Uplink", _uplink(summary)
    if get("downlink", "full") != "full":
        yield "Downlink", f"{get('downlink')}: {_bits(summary, 'down')}{_scheme(summary)}"
    if (narrow := get("narrow") or {}).get("samples_confirmed"):
        yield "Lockstep", lockstep_text(narrow)
    yield from _errors(summary, unicode)
    if learned := summary.get("learned"):
        seen = [learned_text(name, **one) for name, one in learned.items() if is_seen(**one)]
        yield "Model is off by", ", ".join(seen) or "nothing that was learned"
    yield "Link", _link(summary)
    if get("impairments"):
        yield "Impaired", f"{get('impairments')}"
    if get("loop_late_ms_p99") is not None:
        yield (
            "Loop lateness",
            f"{get('loop_late_ms_p50'):.2f} ms median, {get('loop_late_ms_p99'):.2f} ms p99",
        )


def value_text(value: float, unit: str, digits: int = 2, unicode: bool = True) -> str:
    """Return a value with its unit; `digits` are those of an angle."""
    value, unit = in_degrees(value, unit)
    if unit != "deg":
        return f"{value:.3g} {unit}".rstrip()
    return f"{value:.{digits}f}{'°' if unicode else ' deg'}"


def is_seen(error: float, deviation: float) -> bool:
    """Return whether an error that was learned is more than twice its standard deviation."""
    return abs(error) > 2.0 * deviation


def learned_text(name: str, error: float, deviation: float) -> str:
    """Return the learned value of a term: an error in per cent, a force as it is."""
    words = name.replace("_", " ")
    if name.endswith("_force"):
        return f"{words} {error:+.3f} (sd {deviation:.3f})"
    return f"{words} {error:+.1%} (sd {deviation:.1%})"


def _errors(summary: Summary, unicode: bool) -> Iterator[tuple[str, str]]:
    """Yield the errors of every output in its unit, angles in degrees."""
    window = summary.get("window_start_s") or 0.0
    after = f", after the first {window:g} s" if window else ""
    outputs: dict[str, Summary] = summary.get("outputs") or {}

    def shown(value: float, unit: str, digits: int) -> str:
        return value_text(value, unit, digits, unicode)

    for name, one in outputs.items():
        of = f"{name.replace('_', ' ')}: " if len(outputs) > 1 else ""
        rms, most, largest = one["error_live_rms"], one["error_live_max"], one["largest"]
        if rms is not None and most is not None:
            share = f" ({rms / largest:.2%} and {most / largest:.2%} of the largest)" if largest else ""
            error = f"{shown(rms, one['unit'], 2)} rms, {shown(most, one['unit'], 2)} max"
            yield "Estimate error", of + error + share + after
        if one["tracking_rms"] is not None:
            tracking = shown(one["tracking_rms"], one["unit"], 1)
            usual = summary.get("usual_loop")
            beside = f" ({shown(usual['tracking_rms_rad'], 'rad', 1)} over 1000 bit/s)" if usual else ""
            yield "Tracking error", f"{of}{tracking} rms{beside}, steps of the reference included"


def _uplink(summary: Summary) -> str:
    text = _bits(summary, "up")
    up, down = summary.get("wire_bytes_up"), summary.get("wire_bytes_down")
    if up is not None and down is not None:
        text += f"; with framing {_bytes(up)} up, {_bytes(down)} down"
    return text


def _scheme(summary: Summary) -> str:
    scheme = (summary.get("narrow") or {}).get("scheme")
    if scheme == "mirrored":
        return "; set-points only, the law runs beside the plant as well"
    return "; commands, coded" if scheme else ""


def lockstep_text(narrow: Summary) -> str:
    """Return how soon samples were certain, and how long a difference stays unseen."""
    return (
        f"certain after {narrow['confirmed_after_median']} samples (median), "
        f"{narrow['confirmed_after_max']} at most; a difference stays unseen for n samples with "
        f"probability 2^(-{narrow['hash_bits_per_sample']:.2g} n)"
    )


def _bits(summary: Summary, way: str) -> str:
    bits = summary[f"coder_bits_{way}"]
    seconds = summary.get("duration_s")
    return f"{bits:.12g} bits" + (f", {bits / float(seconds):.4g} bit/s" if seconds else "")


def _bytes(count: int) -> str:
    return f"{count / 1000:.1f} kB" if count < 1_000_000 else f"{count / 1e6:.1f} MB"


def _link(summary: Summary) -> str:
    get = summary.get
    parts = [_number(get("erasures"), "word") + " lost", f"{get('symbols_late') or 0} late"]
    if get("rejoins") is not None:
        cost = f" ({get('rejoin_bytes')} bytes)" if get("rejoins") and get("rejoin_bytes") else ""
        parts.append(_number(get("rejoins"), "resync") + cost)
    if get("reconnects"):
        parts.append(_number(get("reconnects"), "reconnect"))
    return ", ".join(parts)


def _number(count: int | None, thing: str) -> str:
    return f"{count or 0} {thing}{'' if count == 1 else 's'}"
