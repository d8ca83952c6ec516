"""A flight's figures for people: a table on the screen, and `summary.json` in the run folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from tenbaud.config.schema import FlightConfig
from tenbaud.files.whole import WriteError, write_whole
from tenbaud.flight.outcome import ExitCode, Outcome, outcome_of
from tenbaud.flight.summary import Summary
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RunFolder

if TYPE_CHECKING:
    from rich.table import Table

ROWS: tuple[tuple[str, str, str], ...] = (
    ("plant", "plant", "{}"),
    ("outcome", "outcome", "{}"),
    ("duration", "duration_s", "{:g} s"),
    ("samples, one word each", "samples", "{}"),
    ("coder bits up", "coder_bits_up", "{:g}"),
    ("baud: configured", "baud_configured", "{:g}"),
    ("baud: measured by the receiver", "baud_measured", "{:.3f}"),
    ("symbols/s asked for / in time / missing", "rate", "{}"),
    ("wire bytes up / down", "wire_bytes", "{}"),
    ("erasures / late symbols", "lost", "{}"),
    ("bytes on the serial line up / down", "line_bytes", "{}"),
    ("dropped by the link", "link_dropped", "{}"),
    ("reconnects", "reconnects", "{}"),
    ("frames dropped, out of bounds", "out_of_bounds", "{}"),
    ("digest checks", "digest_checks", "{}"),
    ("desyncs", "desyncs", "{}"),
    ("rejoins, and what they cost", "rejoins", "{}"),
    ("asked to go wrong", "impairments", "{}"),
    ("went wrong, up / down", "impaired", "{}"),
    ("", "outputs", ""),
    ("disturbance found, density q", "disturbance_rad2_per_s3", "{:.2g} rad^2/s^3"),
    ("rms error over the least possible", "rms_over_floor", "{:.2f}"),
    ("bits an ideal code would need for it", "ideal_bits", "{:.0f}"),
    ("command lead", "lead_ticks", "{} ticks"),
    ("late commands", "commands_late", "{}"),
    ("loop lateness p50 / p99 / max", "lateness", "{}"),
    ("times real time", "realtime_factor", "{:.0f}"),
    ("recording lost", "recording_trouble", "{}"),
)


def write_up(folder: RunFolder, config: FlightConfig, summary: Summary, draw: bool) -> list[Outcome]:
    """Write `summary.json` and, if wished, the figure; return what went wrong.

    The flight is over by then: what cannot be written is no reason to leave out the rest.
    """
    problems = []
    recording_error = summary.get("recording_error")
    if recording_error:
        problems.append(Outcome(ExitCode.NOT_WRITTEN, recording_error))
    try:
        write_summary(folder, summary)
    except WriteError as error:
        problems.append(outcome_of(error))
    if draw:
        try:
            draw_figure(folder, figure_title(config, summary))
        except (RecordingError, WriteError) as error:
            code = ExitCode.NOT_WRITTEN if isinstance(error, WriteError) else ExitCode.OK
            problems.append(Outcome(code, f"no figure was drawn: {error}"))
    return problems


def write_summary(folder: RunFolder, summary: Summary) -> None:
    """Write `summary.json`. Raises WriteError."""
    write_whole(folder.summary, json.dumps(summary, indent=2) + "\n")


def draw_figure(folder: RunFolder, title: str) -> None:
    """Draw the figure of a run from its recordings. Raises RecordingError and WriteError."""
    from tenbaud.recording.figure import draw_flight

    receiver = folder.receiver if folder.receiver.is_file() else None
    draw_flight(folder.transmitter, receiver, folder.figure, title)


def figure_title(config: FlightConfig, summary: Summary) -> str:
    """Return what stands over a flight's figure."""
    return f"{config.preset}: {summary.get('plant', '')}, {config.channel.rate_baud:g} bit/s"


def show_summaries(
    summaries: Sequence[Summary], folders: Sequence[RunFolder], *, verbose: bool = False
) -> None:
    """Print how flights ended; with `verbose` also every figure, the flights side by side."""
    from rich.console import Console

    from tenbaud.flight.closing import closing_lines
    from tenbaud.flight.screen import unicode_fits

    console = Console()
    if verbose:
        console.print(_table(summaries))
    for summary, folder in zip(summaries, folders, strict=True):
        lines = closing_lines(summary, folder, unicode=unicode_fits(console))
        console.print("\n".join(lines), soft_wrap=True, highlight=False, markup=False)


def _table(summaries: Sequence[Summary]) -> Table:
    from rich.table import Table

    first = summaries[0]
    title = f"{first['preset']} over {first['link']}, {first['clock']} clock"
    table = Table(title=title, title_justify="left", show_header=False)
    table.add_column(style="dim")
    for _ in summaries:
        table.add_column(overflow="fold")
    for label, name, form in ROWS:
        if name == "outputs":
            for output in first.get("outputs") or {}:
                for row in _output_rows(output, [one["outputs"][output] for one in summaries]):
                    table.add_row(*row)
            continue
        cells = [_cell(summary, name, form) for summary in summaries]
        if any(cells):
            table.add_row(label, *cells)
    return table


def _output_rows(name: str, figures: Sequence[Summary]) -> Iterator[list[str]]:
    """Yield label and cells of what is known of an output."""
    name = name.replace("_", " ")

    def quantity(one: Summary, key: str) -> str:
        return "" if one[key] is None else f"{one[key]:.3f} {one['unit']}".rstrip()

    def error(one: Summary, kind: str) -> str:
        largest, rms = one[f"{kind}_max"], one[f"{kind}_rms"]
        if largest is None or rms is None or not one["largest"]:
            return ""
        return f"{largest / one['largest']:.2%} / {rms / one['largest']:.2%} of the largest {name}"

    yield [f"largest {name} in the window", *(quantity(one, "largest") for one in figures)]
    yield ["error of the codec: max / rms", *(error(one, "error_coded") for one in figures)]
    yield ["error of the prediction: max / rms", *(error(one, "error_live") for one in figures)]
    shares = [one.get("symbols_share") for one in figures]
    if any(share not in (None, 1.0) for share in shares):
        yield [f"symbols about {name}", *("" if one is None else f"{one:.1%}" for one in shares)]
    yield ["tracking, rms", *(quantity(one, "tracking_rms") for one in figures)]


def _cell(summary: Summary, name: str, form: str) -> str:
    value = _value(summary, name)
    return "" if value is None else form.format(value)


def _value(summary: Summary, name: str) -> Any:
    get = summary.get
    match name:
        case "wire_bytes":
            return f"{get('wire_bytes_up')} / {get('wire_bytes_down')}"
        case "lost":
            late = get("symbols_late")
            return f"{get('erasures')} / {'-' if late is None else late}"
        case "rate":
            asked, kept = get("symbols_per_s_asked"), get("symbols_per_s_kept")
            if kept is None or get("loop_late_ms_p50") is None:
                return None
            return f"{asked:g} / {kept:.1f} / {get('symbols_missing_share'):.2%}"
        case "rejoins":
            cost = f", {get('rejoin_bytes')} control bytes" if get("rejoin_bytes") is not None else ""
            return f"{get('rejoins')}{cost}" if get("rejoins") else None
        case "impairments":
            return get(name) or None
        case "impaired":
            ways = [get("impaired_up") or {}, get("impaired_down") or {}]
            told = [", ".join(f"{count} {what}" for what, count in way.items()) for way in ways]
            return " / ".join(text or "-" for text in told) if any(told) else None
        case "line_bytes":
            up, down = get("line_bytes_out"), get("line_bytes_in")
            return f"{up} / {down}" if up else None
        case "link_dropped":
            return ", ".join(f"{kind} {n}" for kind, n in (get("link_dropped") or {}).items()) or None
        case "reconnects" | "out_of_bounds":
            return get(name) or None
        case "lateness":
            if get("loop_late_ms_p50") is None:
                return None
            return (
                f"{get('loop_late_ms_p50'):.2f} / {get('loop_late_ms_p99'):.2f} / "
                f"{get('loop_late_ms_max'):.2f} ms"
            )
        case "recording_trouble":
            if not get("recording_rows_lost") and not get("recording_error"):
                return None
            return f"{get('recording_rows_lost')} rows: {get('recording_error') or 'queue full'}"
        case _:
            return get(name)
