"""The figures of a flight: those of each end, joined into one `summary.json`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from channel.codec.coders.learning import learned_of
from channel.links.base import Link
from channel.protocol.bounds import COUNTER
from channel.protocol.endings import End
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tenbaud.build.flight import Agreement
from tenbaud.build.recorded import replay_notes
from tenbaud.build.rig import real_rig_name
from tenbaud.build.transmitter_run import TransmitterRun
from tenbaud.flight.outcome import Outcome
from tenbaud.recording.writer import McapRecorder
from tenbaud.sentences import events
from tenbaud.sentences.flown import Summary
from transmitter.metrics.gap import Gap
from transmitter.metrics.scores import ErrorMeter
from transmitter.session.down_symbols import NarrowFollowing
from transmitter.session.session import TransmitterSession


def transmitter_part(run: TransmitterRun, outcome: Outcome) -> Summary:
    """Return the transmitter's figures: plant, errors, bits sent, its loop."""
    node, terms, config = run.node, run.agreement.terms, run.agreement.config
    session, scores, meter = node.session, node.scores.first, run.uplink.meter
    flown_s = run.ticks * terms.tick_ns / 1e9
    return {
        **_common(run.agreement, outcome, session.end),
        "plant": _plant_name(run.agreement),
        "seed": config.seed,
        "duration_s": flown_s,
        "samples": session.next_sample,
        "coder_bits_up": meter.coder_bits,
        "wire_bytes_up": meter.wire_bytes,
        "coder_bits_down": run.endpoint.inlet.meter.coder_bits,
        "wire_bytes_down": run.wire_bytes_down,
        **counted(session, "erasures", "digest_checks", "desyncs", "rejoins"),
        "rejoin_bytes": run.rejoin_bytes,
        "stale_commands": session.counts["stale_frames"],
        **counted(session, COUNTER, "claims_refused", "take_overs"),
        "rejoins_asked": {why.name.lower(): n for why, n in session.rejoins_asked.items()},
        "guard_rearmed": node.rearmed,
        "ticks_guard_down": node.ticks_down,
        "ticks_commanded": node.ticks_commanded,
        "ticks_at_limit": node.ticks_at_limit,
        "impairments": config.link.impairments,
        "impaired_up": dict(run.uplink.line.counts),
        "impaired_down": dict(run.downlink.counts),
        "window_start_s": run.agreement.window_start_tick * terms.tick_ns / 1e9,
        "pitch_amplitude_rad": scores.largest,
        "reference_amplitude_rad": scores.reference_largest or None,
        **_errors("error_coded", scores.coded, scores.largest, scores.reference_largest),
        **_errors("error_live", scores.live, scores.largest, scores.reference_largest),
        "tracking_rms_rad": scores.tracking.rms,
        "outputs": _outputs(run),
        **_learned(run),
        **gap_part(node.gauge.whole if node.gauge is not None else None),
        "commands_late": node.commands_late,
        "symbols_refused": run.uplink.refused,
        **counted(session, "words_missed"),
        **_rate(run),
        "sensor_fault": events.guard_text(node.sensor_fault) or None,
        "loop_late_ms_p50": None,
        "loop_late_ms_p99": None,
        "loop_late_ms_max": None,
        "realtime_factor": flown_s / run.flight_s if run.flight_s else None,
        **narrow_part(run),
        **run.extra,
    }


def counted(session: TransmitterSession | ReceiverSession, *names: str) -> Summary:
    """Return some counts of a session."""
    return {name: session.counts[name] for name in names}


def recording_part(recorder: McapRecorder) -> Summary:
    """Return how well the rows of an end were recorded."""
    return {
        "recording_rows": recorder.rows_written,
        "recording_rows_lost": recorder.rows_dropped,
        "recording_error": recorder.error,
    }


def narrow_part(run: TransmitterRun) -> Summary:
    """Return the figures of a narrow downlink, and of how sure this end is of the other."""
    session, terms, meter = run.node.session, run.agreement.terms, run.endpoint.inlet.meter
    following, counts = session.following, session.counts
    if not isinstance(following, NarrowFollowing):
        return {}
    listed, certainty, confirmed = following.hypotheses, following.certainty, counts["confirmed"]
    return {
        "narrow": {
            "scheme": "mirrored" if terms.is_mirrored else "coded",
            "baud_configured": terms.downlink_baud,
            "symbols_per_s_asked": 1e9 * terms.down_symbols / terms.sample_ns,
            "symbols_down": meter.symbols,
            "control_bytes_down": meter.control_bytes,
            "symbols_erased": counts["down_erased"],
            "symbols_late": counts["down_late"],
            "samples_confirmed": confirmed,
            "confirmed_to": listed.next_confirmed,
            "rest": listed.rest,
            "confirmed_after_median": certainty.delay_median,
            "confirmed_after_max": certainty.delay_max,
            "hypotheses_mean": certainty.size_mean,
            "hypotheses_max": certainty.size_max,
            "hash_bits_per_sample": counts["hash_symbols"] / confirmed if confirmed else None,
        }
    }


def _rate(run: TransmitterRun) -> Summary:
    """Return the symbol rate asked for, the one kept, and the share that is missing."""
    terms, counts = run.agreement.terms, run.node.session.counts
    asked = 1e9 * terms.symbols_per_word / terms.sample_ns
    share: float | None = None
    if run.ticks:
        samples = run.ticks / terms.ticks_per_sample
        if terms.is_narrow:
            # Whether the last words were consumed, in a short flight all, was not certain yet.
            samples = counts["confirmed"]
        if samples:
            share = min(1.0, (counts["confirmed"] - counts["erasures"]) / samples)
    return {
        "symbols_per_s_asked": asked,
        "symbols_per_s_kept": None if share is None else share * asked,
        "symbols_missing_share": None if share is None else 1.0 - share,
    }


def gap_part(gap: Gap | None) -> Summary:
    """Return the gap gauge, with nothing in it where there is nothing to compare."""
    return {
        "disturbance_density": gap and gap.density,
        "rms_over_floor": gap and gap.rms_over_floor,
        "ideal_bits": gap and gap.ideal_bits,
    }


def receiver_part(agreement: Agreement, endpoint: ReceiverEndpoint, outcome: Outcome) -> Summary:
    """Return the receiver's figures: symbols as they arrived, on its own clock."""
    session, sent = endpoint.session, endpoint.downlink.meter
    narrow = {"symbols_down": sent.symbols, "control_bytes_down": sent.control_bytes}
    return {
        **_common(agreement, outcome, session.end),
        **({} if agreement.two_way is None else {"narrow": narrow}),
        "samples": session.state.sample,
        "baud_measured": session.meter.whole_baud,
        "wire_bytes_up": endpoint.inlet.meter.wire_bytes,
        "coder_bits_down": endpoint.downlink.meter.coder_bits,
        "wire_bytes_down": endpoint.downlink.meter.wire_bytes,
        **counted(session, "erasures", "symbols_late", "symbols_misplaced", "stale_frames"),
        **counted(session, COUNTER, "bad_commands"),
        "malformed": endpoint.inlet.malformed,
        **counted(session, "desyncs", "rejoins"),
        "impaired_down": dict(endpoint.downlink.line.counts),
    }


def link_part(link: Link, refused: Counter[str] | None = None) -> Summary:
    """Return the figures of an end's link: dropped messages by reason, and its own bytes if any.

    `refused` are connections that were turned away before the link knew of them.
    """
    counts = link.counts
    return {
        "connections_refused": dict(counts.refused + (refused or Counter())),
        "link_dropped": dict(counts.dropped),
        "reconnects": counts.reconnects,
        "line_bytes_out": counts.line_bytes_out,
        "line_bytes_in": counts.line_bytes_in,
    }


def joined(transmitter: Summary, receiver: Summary) -> Summary:
    """Return one summary: the transmitter's figures, and those that only the receiver has.

    Of an end that was killed there is none; without the transmitter's the receiver's figures stand.
    """
    if not transmitter:
        return dict(receiver)
    own = ("baud_measured", "symbols_late", "symbols_misplaced", "stale_frames", "bad_commands")
    both: Summary = {
        name: dict(Counter(transmitter.get(name, {})) + Counter(receiver.get(name, {})))
        for name in ("link_dropped", "connections_refused")
    }
    for name in ("reconnects", "malformed", "recording_rows_lost", COUNTER):
        both[name] = transmitter.get(name, 0) + receiver.get(name, 0)
    both["recording_error"] = transmitter.get("recording_error") or receiver.get("recording_error")
    if receiver.get("coder_bits_down"):
        both["coder_bits_down"] = receiver["coder_bits_down"]
    if "narrow" in transmitter:
        both["narrow"] = {**transmitter["narrow"], **receiver.get("narrow", {})}
    if receiver.get("impaired_down"):
        both["impaired_down"] = receiver["impaired_down"]
    return {**transmitter, **both, **{name: receiver.get(name) for name in own}}


def _common(agreement: Agreement, outcome: Outcome, end: End | None) -> Summary:
    config = agreement.config
    return {
        "preset": config.preset,
        "outcome": outcome.text,
        "exit_code": int(outcome.code),
        "ending": end and end.ending.name.lower(),
        "ended_by_peer": end and end.by_peer,
        "not_flown": [fault.value for fault in outcome.not_flown],
        "link": config.link.kind,
        "clock": agreement.clock,
        "lead_ticks": agreement.terms.lead_ticks,
        "delivery": config.channel.delivery,
        "baud_configured": config.channel.rate_baud,
        "downlink": config.channel.downlink,
        "config_digest": agreement.identity.config_digest.hex(),
        "numerics_probe": agreement.identity.numerics_probe.hex(),
        "version": agreement.identity.version,
        **({"flight_log_notes": list(notes)} if (notes := replay_notes(config)) else {}),
    }


def _plant_name(agreement: Agreement) -> str:
    section = agreement.config.transmitter
    if section.rig == "replay":
        return f"replay of {Path(agreement.config.flight_log.file).name}"
    if section.rig != "simulated":
        return real_rig_name(section)
    mismatch = section.plant.mismatch
    off = mismatch if isinstance(mismatch, tuple) else (mismatch,)
    name = agreement.config.plant_kind
    if any(off):
        name += " off the model by " + ", ".join(f"{value:+.0%}" for value in off)
    if section.plant.disturbance:
        name += f", disturbed by {section.plant.disturbance}"
    return name


def _outputs(run: TransmitterRun) -> Summary:
    """Return the figures of every output, by its name, in its own unit."""
    figures = {}
    symbols = sum(scores.symbols for scores in run.node.scores.outputs)
    for output, scores in zip(run.agreement.signals.outputs, run.node.scores.outputs, strict=True):
        figures[output.name] = {
            "unit": output.unit,
            "largest": scores.largest,
            "error_coded_max": scores.coded.largest if scores.coded.count else None,
            "error_coded_rms": scores.coded.rms,
            "error_live_max": scores.live.largest if scores.live.count else None,
            "error_live_rms": scores.live.rms,
            "tracking_rms": scores.tracking.rms,
            "symbols_share": scores.symbols / symbols if symbols else None,
        }
    return figures


def _learned(run: TransmitterRun) -> Summary:
    """Return the plant's terms as learned by both ends, if they do."""
    found = learned_of(run.agreement.codec, run.node.session.confirmed_state)
    return {"learned": {name: one._asdict() for name, one in found.items()}} if found else {}


def _errors(name: str, meter: ErrorMeter, angle_max: float, reference_max: float) -> Summary:
    def share(value: float | None, whole: float) -> float | None:
        return value / whole if value is not None and whole else None

    most, rms = meter.largest if meter.count else None, meter.rms
    return {
        f"{name}_max_rad": most,
        f"{name}_rms_rad": rms,
        f"{name}_max_fraction": share(most, angle_max),
        f"{name}_rms_fraction": share(rms, angle_max),
        f"{name}_max_of_reference": share(most, reference_max),
    }
