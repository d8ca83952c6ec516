"""What is in a recording, in numbers and in words."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from channel.recording import Field, RecordChannel
from tenbaud.recording.folder import RunFolder, find_recordings
from tenbaud.recording.reader import Recording, Row, TopicSummary
from tenbaud.recording.writer import END_METADATA

EVENT_TOPIC = "event"
EVENTS_SHOWN = 20


@dataclass(frozen=True, slots=True)
class Description:
    """One recording. `rows_dropped` is None when the file was cut before it could say."""

    path: Path
    size_bytes: int
    complete: bool
    metadata: dict[str, str]
    rows_dropped: int | None
    error: str | None
    topics: dict[str, TopicSummary]
    events: list[Row]
    """The first twenty."""


def describe(path: Path) -> list[Description]:
    """Describe a recording, or each recording of a run folder.

    Raises RecordingError if there is none or a file is not a recording.
    """
    return [_describe_file(file) for file in find_recordings(path)]


def describe_text(path: Path) -> str:
    """The same for a person, as plain text; for a run folder headed by the run's figures."""
    described = describe(path)
    parts = [_headline(path), *(_text(description) for description in described)]
    cut = [description.path for description in described if not description.complete]
    if cut:
        parts.append(f"`tenbaud recover {path}` makes whole files of what was cut")
    return "\n\n".join(part for part in parts if part)


def describe_json(path: Path) -> list[dict[str, Any]]:
    """The same for a program: plain dictionaries."""
    return [_plain(description) for description in describe(path)]


def _headline(path: Path) -> str:
    """Return what `summary.json` says in one line; empty without it."""
    folder = RunFolder(path)
    text = folder.text_of(folder.summary)
    try:
        summary = json.loads(text or "null")
    except ValueError:
        return ""
    if not isinstance(summary, dict):
        return ""
    parts = [
        f"{summary.get('preset')}: {summary.get('outcome')}",
        f"{summary['duration_s']:g} s" if "duration_s" in summary else "",
        f"{summary['coder_bits_up']:g} bits up" if "coder_bits_up" in summary else "",
        f"{summary['erasures']} erasures" if summary.get("erasures") else "",
        f"{summary['desyncs']} desyncs" if summary.get("desyncs") else "",
    ]
    return ", ".join(part for part in parts if part)


def _plain(description: Description) -> dict[str, Any]:
    return {
        "path": str(description.path),
        "size_bytes": description.size_bytes,
        "complete": description.complete,
        "rows_dropped": description.rows_dropped,
        "error": description.error,
        "metadata": description.metadata,
        "topics": {
            topic: {
                "rows": summary.rows,
                "first_time_s": summary.first_time_ns / 1e9,
                "last_time_s": summary.last_time_ns / 1e9,
                "fields": [asdict(field) for field in summary.channel.fields],
            }
            for topic, summary in description.topics.items()
        },
        "events": description.events,
    }


def _describe_file(path: Path) -> Description:
    recording = Recording(path)
    end = recording.metadata_record(END_METADATA)
    return Description(
        path=path,
        size_bytes=path.stat().st_size,
        complete=recording.complete,
        metadata=recording.metadata,
        rows_dropped=int(end["rows_dropped"]) if "rows_dropped" in end else None,
        error=end.get("error"),
        topics=recording.topics,
        events=[row for _, row in islice(recording.rows(EVENT_TOPIC), EVENTS_SHOWN)],
    )


def _text(description: Description) -> str:
    state = "complete" if description.complete else "cut: these are the rows up to the cut"
    lines = [str(description.path), f"  {description.size_bytes / 1e6:.2f} MB, {state}"]
    if description.rows_dropped:
        lines.append(f"  {description.rows_dropped} rows were dropped")
    if description.error is not None:
        lines.append(f"  {description.error}")
    for name, value in description.metadata.items():
        lines.extend(_metadata_lines(name, value))
    for topic, summary in description.topics.items():
        lines.append("")
        lines.append(f"  {topic}: {_span(summary)}")
        lines.extend(_field_lines(summary.channel))
    if description.events:
        total = description.topics[EVENT_TOPIC].rows
        shown = len(description.events)
        lines.append("")
        lines.append("  events" if shown == total else f"  the first {shown} of {total} events")
        lines.extend(f"    {_event_line(row)}" for row in description.events)
    return "\n".join(lines)


def _metadata_lines(name: str, value: str) -> list[str]:
    """Return one line; for a configuration, which is JSON, one per section."""
    try:
        sections = json.loads(value) if value.startswith("{") else None
    except ValueError:
        sections = None
    if not isinstance(sections, dict):
        return [f"  {name} = {value}"]
    lines = [f"  {name}"]
    for section, fields in sections.items():
        told = ", ".join(f"{field} {json.dumps(one)}" for field, one in fields.items())
        lines.append(f"    {section}: {told}")
    return lines


def _span(summary: TopicSummary) -> str:
    first_s, last_s = summary.first_time_ns / 1e9, summary.last_time_ns / 1e9
    noun = "row" if summary.rows == 1 else "rows"
    return f"{summary.rows} {noun}, {first_s:.3f} s to {last_s:.3f} s"


def _field_lines(channel: RecordChannel) -> list[str]:
    width = max(len(field.name) for field in channel.fields)
    return [f"    {field.name:<{width}}  {_meaning(field)}".rstrip() for field in channel.fields]


def _meaning(field: Field) -> str:
    unit = f"[{field.unit}]" if field.unit else ""
    clock = ""
    if field.timing:
        clock = "(wall clock)" if field.unit in ("s", "ms", "ns") else "(may differ between runs)"
    return "  ".join(part for part in (unit, field.description, clock) if part)


def _event_line(row: Row) -> str:
    time_s = row.get("time_s")
    time = f"{time_s:9.3f} s" if isinstance(time_s, int | float) else " " * 11
    sample = "" if row.get("sample") is None else f" (sample {row['sample']})"
    return f"{time}  {row.get('kind', '')}: {row.get('text', '')}{sample}"
