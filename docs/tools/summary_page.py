"""The reference page of `summary.json`: what `reference.py` writes."""

from __future__ import annotations

INTRODUCTION = """# Summary

<!-- Written by `make reference` from docs/tools/summary_page.py. Change that, not this page. -->

`summary.json` in a run's folder has these figures; `--json` prints them, and `--verbose` shows them. A
run of both ends has the transmitter's figures and the receiver's own; a run of a single end has its
own. null: unknown. Errors and amplitudes count from `window_start_s` on. The fields with
`pitch` or `rad` in their name are of the first output, in its unit if it is not an angle; `outputs` has
those of every output.

| field | unit | meaning |
|---|---|---|
"""

FIELDS: dict[str, tuple[str, str]] = {
    "preset": ("", "preset that the configuration is based on"),
    "link": ("", "kind of link"),
    "clock": ("", "virtual or real"),
    "outcome": ("", "how the flight ended, for people; no program should read it"),
    "exit_code": ("", "of the command; 0: the flight succeeded and is recorded"),
    "ending": ("", "how the session ended, by name"),
    "ended_by_peer": ("", "whether the other end ended it"),
    "not_flown": ("", "the faults of a flight with exit code 7"),
    "lead_ticks": ("ticks", "command lead D"),
    "delivery": ("", "whether a symbol arrives at the start or at the end of its slot"),
    "baud_configured": ("baud", "largest number of symbols per second up the link"),
    "baud_measured": (
        "baud",
        "symbols per second from the first that arrived to the last, on the receiver's clock",
    ),
    "config_digest": ("", "of the shared configuration; equal at both ends"),
    "numerics_probe": ("", "digest of the codec run over fixed vectors; equal on all machines"),
    "version": ("", "of the software"),
    "flight_log_notes": ("", "notes about the replayed recording"),
    "plant": ("", "kind of the plant"),
    "seed": ("", "of all random numbers"),
    "duration_s": ("s", "flight time flown"),
    "samples": ("samples", "that both ends share"),
    "coder_bits_up": ("bits", "sent to the receiver; the rate R limits these"),
    "downlink": ("", "how commands and echoes come back: full, compact or narrow"),
    "coder_bits_down": (
        "bits",
        "of command frames from the receiver, without a serial line's framing, or of down symbols",
    ),
    "narrow": ("", "of a narrow downlink:"),
    "narrow.scheme": ("", "mirrored: the law runs beside the plant as well; coded: commands come down"),
    "narrow.baud_configured": ("baud", "largest number of symbols per second down the link"),
    "narrow.symbols_per_s_asked": ("symbols/s", "that the layout sends"),
    "narrow.symbols_down": ("symbols", "sent to the transmitter, a bit each"),
    "narrow.control_bytes_down": ("bytes", "of frames of the handshake and of rejoins, with framing"),
    "narrow.symbols_erased": ("symbols", "that did not come within their deadline"),
    "narrow.symbols_late": ("symbols", "that came after it"),
    "narrow.samples_confirmed": ("samples", "of which the transmitter became certain"),
    "narrow.confirmed_to": ("samples", "the first sample that was not certain at the end"),
    "narrow.rest": ("", "weight of all that the transmitter does not follow, in units of what it does"),
    "narrow.confirmed_after_median": ("samples", "that passed until a sample was certain, median"),
    "narrow.confirmed_after_max": ("samples", "the longest that it took"),
    "narrow.hypotheses_mean": (
        "",
        "states that the transmitter took for possible, mean",
    ),
    "narrow.hypotheses_max": ("", "largest number of them"),
    "narrow.hash_bits_per_sample": (
        "bits",
        "h, as they came: a difference stays unseen for n samples with probability 2^(-h n)",
    ),
    "wire_bytes_up": ("bytes", "of all frames to the receiver, framing included"),
    "wire_bytes_down": ("bytes", "of all frames to the transmitter, framing included"),
    "line_bytes_out": ("bytes", "that this end put on a serial line"),
    "line_bytes_in": ("bytes", "that this end took from a serial line"),
    "erasures": ("words", "that did not arrive whole within their deadline"),
    "symbols_late": ("symbols", "that arrived after their deadline"),
    "symbols_misplaced": ("symbols", "that arrived for a slot of another time"),
    "symbols_refused": ("symbols", "that the rate limiter refused"),
    "symbols_per_s_asked": ("symbols/s", "by the configuration"),
    "symbols_per_s_kept": ("symbols/s", "consumed in time"),
    "symbols_missing_share": ("", "share of the slots without a symbol in time"),
    "words_missed": ("words", "that the transmitter could not form in time"),
    "digest_checks": ("samples", "whose two digests were compared"),
    "desyncs": ("", "differences of the two codecs that were detected"),
    "rejoins": ("", "new epochs from a common state"),
    "rejoin_bytes": ("bytes", "of the control frames of all rejoins"),
    "rejoins_asked": ("", "number of rejoin requests, by reason"),
    "stale_commands": ("frames", "of commands of an earlier epoch, dropped by the transmitter"),
    "stale_frames": ("frames", "of an earlier session or epoch, dropped by the receiver"),
    "out_of_bounds": ("frames", "with values out of bounds, dropped"),
    "malformed": ("messages", "that were not frames, dropped"),
    "claims_refused": ("", "requests of a second receiver that were refused"),
    "take_overs": ("", "receivers that took the flight over"),
    "connections_refused": ("", "connections turned away, by reason"),
    "link_dropped": ("", "messages dropped by the link, by reason"),
    "reconnects": ("", "lines that were lost and opened again"),
    "commands_late": ("ticks", "without their own command in time"),
    "commands_refused": ("", "commands of viewers that were refused"),
    "ticks_commanded": ("ticks", "with their own command"),
    "ticks_at_limit": ("ticks", "of these, with an input at `limits.command_max`"),
    "ticks_guard_down": ("ticks", "with the guard at the safe command or ramping to it"),
    "ticks_missed": ("ticks", "that a loop on the real clock skipped"),
    "guard_rearmed": ("", "how often the guard was armed again"),
    "bad_commands": ("ticks", "at which the controller failed, or gave no finite value for each input"),
    "sensor_fault": ("", "fault of the sensor"),
    "impairments": ("", "of the line, on purpose, as `--impair` takes them"),
    "impaired_up": ("", "number of messages to the receiver that they affected, by kind"),
    "impaired_down": ("", "the same to the transmitter"),
    "window_start_s": (
        "s",
        "flight time from which errors count: the first period is excluded",
    ),
    "pitch_amplitude_rad": ("rad", "largest value of the first output, either way"),
    "reference_amplitude_rad": ("rad", "largest set-point of the first output, either way"),
    "error_coded_max_rad": ("rad", "largest error of the codec's own estimate"),
    "error_coded_rms_rad": ("rad", "its rms error"),
    "error_coded_max_fraction": ("", "largest error over the largest value of the output"),
    "error_coded_rms_fraction": ("", "rms error over the same"),
    "error_coded_max_of_reference": ("", "largest error over the largest set-point"),
    "error_live_max_rad": ("rad", "largest error of the estimate that commands are computed from"),
    "error_live_rms_rad": ("rad", "its rms error"),
    "error_live_max_fraction": ("", "largest error over the largest value of the output"),
    "error_live_rms_fraction": ("", "rms error over the same"),
    "error_live_max_of_reference": ("", "largest error over the largest set-point"),
    "tracking_rms_rad": ("rad", "rms of set-point minus output, steps of the reference included"),
    "outputs": ("", "the figures of each output, by its name:"),
    "outputs.NAME.unit": ("", "unit of the output and of its errors"),
    "outputs.NAME.largest": ("of the output", "largest value, either way"),
    "outputs.NAME.error_coded_max": ("of the output", "largest error of the codec's own estimate"),
    "outputs.NAME.error_coded_rms": ("of the output", "its rms error"),
    "outputs.NAME.error_live_max": (
        "of the output",
        "largest error of the estimate that commands are computed from",
    ),
    "outputs.NAME.error_live_rms": ("of the output", "its rms error"),
    "outputs.NAME.tracking_rms": ("of the output", "rms of set-point minus output"),
    "outputs.NAME.symbols_share": ("", "share of the symbols for this output"),
    "usual_loop": (
        "",
        "the loop over 1000 bit/s that `tenbaud demo` flew with the same plant and law:",
    ),
    "usual_loop.rate_baud": ("baud", "its symbols per second"),
    "usual_loop.tracking_rms_rad": ("rad", "rms of set-point minus output"),
    "usual_loop.error_live_rms_rad": (
        "rad",
        "rms error of the angle that its commands use",
    ),
    "disturbance_density": ("rad²/s³", "estimated density q of the first disturbance, of a torque"),
    "rms_over_floor": ("", "rms live error over the theoretical minimum at this rate"),
    "ideal_bits": ("bits", "that an ideal code would need for the same error"),
    "loop_late_ms_p50": ("ms", "median lateness of the loop's ticks"),
    "loop_late_ms_p99": ("ms", "lateness of the ticks, 99th percentile"),
    "loop_late_ms_max": ("ms", "largest lateness"),
    "realtime_factor": ("", "flight time over elapsed time"),
    "rig": ("", "counts of a real rig"),
    "telemetry": ("", "on, off, or why there was none"),
    "telemetry_sent": ("messages", "of telemetry"),
    "telemetry_dropped": ("messages", "of telemetry dropped: a viewer was too slow"),
    "telemetry_rows_dropped": ("rows", "of telemetry dropped"),
    "recording_rows": ("rows", "written to this end's recording"),
    "recording_rows_lost": ("rows", "lost because the disk was too slow"),
    "recording_error": ("", "why the recording is incomplete"),
}
SOMETIMES = {
    *("flight_log_notes", "ticks_missed", "rig", "usual_loop", "commands_refused", "narrow"),
}
"""Fields that only some flights have."""


def summary_page() -> str:
    """Return the whole page."""
    rows = [f"| `{name}` | {unit} | {text} |" for name, (unit, text) in FIELDS.items()]
    return INTRODUCTION + "\n".join(rows) + "\n"
