"""What is in a recording, in numbers and in words."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from channel.recording import Field, RecordChannel
from tenbaud.recording.folder import find_recordings
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
    """The same for a person, as plain text."""
    return "\n\n".join(_text(description) for description in describe(path))


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
    lines.extend(f"  {name} = {value}" for name, value in description.metadata.items())
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


def _span(summary: TopicSummary) -> str:
    first_s, last_s = summary.first_time_ns / 1e9, summary.last_time_ns / 1e9
    noun = "row" if summary.rows == 1 else "rows"
    return f"{summary.rows} {noun}, {first_s:.3f} s to {last_s:.3f} s"


def _field_lines(channel: RecordChannel) -> list[str]:
    width = max(len(field.name) for field in channel.fields)
    return [f"    {field.name:<{width}}  {_meaning(field)}".rstrip() for field in channel.fields]


def _meaning(field: Field) -> str:
    unit = f"[{field.unit}]" if field.unit else ""
    clock = "(wall clock)" if field.timing else ""
    return "  ".join(part for part in (unit, field.description, clock) if part)


def _event_line(row: Row) -> str:
    time_s = row.get("time_s")
    time = f"{time_s:9.3f} s" if isinstance(time_s, int | float) else " " * 11
    sample = "" if row.get("sample") is None else f" (sample {row['sample']})"
    return f"{time}  {row.get('kind', '')}: {row.get('text', '')}{sample}"
