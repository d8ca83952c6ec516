"""The contents of a recording, in numbers and sentences."""

from __future__ import annotations

import json
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any

import orjson

from channel.protocol.recording import Field, RecordChannel
from tenbaud.recording.encoding import END_METADATA, SIGNALS_KEY, recorded_signals
from tenbaud.recording.folder import RunFolder, find_recordings, read_summary
from tenbaud.recording.notes import printable, recording_notes
from tenbaud.recording.reader import Recording
from tenbaud.recording.rows import Row
from tenbaud.recording.table import Table
from tenbaud.sentences import events
from tenbaud.sentences.flown import lockstep_text

EVENT_TOPIC = "event"
EVENTS_SHOWN = 20


def describe_text(path: Path) -> str:
    """Describe a recording, or each recording of a run folder, headed by the run's figures.

    Raises RecordingError if there is none or a file is not a recording.
    """
    recordings = [Recording(file) for file in find_recordings(path)]
    printed: set[object] = set()
    parts = [_headline(path), *[_text(recording, printed) for recording in recordings]]
    if not all(recording.complete for recording in recordings):
        parts.append(f"`tenbaud recover {path}` repairs truncated or damaged files")
    return printable("\n\n".join(part for part in parts if part))


def describe_json(path: Path) -> list[dict[str, Any]]:
    """The same for a program: plain dictionaries."""
    return [_plain(Recording(file)) for file in find_recordings(path)]


def _headline(path: Path) -> str:
    """Return `summary.json` in one line, or two with a narrow downlink; empty without it."""
    summary = read_summary(RunFolder(path).summary)
    if not summary:
        return ""
    parts, certain = [f"{summary.get('preset')}: {summary.get('outcome')}"], ""
    for name, form in (
        ("duration_s", "{:g} s"),
        ("coder_bits_up", "{:.12g} bits up"),
        ("erasures", "{:.12g} words lost"),
        ("desyncs", "{:.12g} desyncs"),
    ):
        value = summary.get(name)
        if isinstance(value, int | float) and (value or name not in ("erasures", "desyncs")):
            parts.append(form.format(value))
    if (narrow := summary.get("narrow") or {}).get("samples_confirmed"):
        parts.append(f"{summary['coder_bits_down']:.12g} bits down")
        parts.append(f"{narrow['samples_confirmed']} of {summary['samples']} samples confirmed")
        certain = f"\n  {lockstep_text(narrow)}"
    return ", ".join(part for part in parts if part) + certain


def _plain(recording: Recording) -> dict[str, Any]:
    end = recording.metadata_record(END_METADATA)
    dropped = end.get("rows_dropped", "")
    return {
        "path": str(recording.path),
        "size_bytes": recording.path.stat().st_size,
        "complete": recording.complete,
        # null: the file was cut before it could say
        "rows_dropped": int(dropped) if dropped.isascii() and dropped.isdigit() else None,
        "error": end.get("error"),
        # Whether it was cut is said beside its size.
        "notes": recording_notes(
            recording.path, recording.metadata, True, recording.holes, recording.strays
        ),
        "holes": [asdict(hole) for hole in recording.holes],
        "metadata": recording.metadata,
        "topics": {
            topic: {
                "rows": len(table),
                "first_time_s": table.first_time_ns / 1e9,
                "last_time_s": table.last_time_ns / 1e9,
                "fields": [asdict(field) for field in table.channel.fields],
            }
            for topic, table in recording.topics.items()
        },
        "events": [row for _, row in islice(recording.rows(EVENT_TOPIC), EVENTS_SHOWN)],
    }


def _text(recording: Recording, printed: set[object]) -> str:
    """Return a recording as text; of what the other end's has `printed`, only the names."""
    plain, state = _plain(recording), "complete"
    if not recording.complete:
        state = "damaged: these are the rows that are whole"
        if not recording.holes:
            state = "cut: these are the rows up to the cut"
    lines = [str(recording.path), f"  {plain['size_bytes'] / 1e6:.2f} MB, {state}"]
    if plain["rows_dropped"]:
        lines.append(f"  {plain['rows_dropped']} rows were dropped")
    if plain["error"] is not None:
        lines.append(f"  {plain['error']}")
    lines += [f"  {note}" for note in plain["notes"]]
    same = [item for item in recording.metadata.items() if item in printed]
    for name, value in recording.metadata.items():
        if (name, value) not in printed:
            lines.extend(_metadata_lines(name, value))
    if same:
        lines.append(f"  as above: {', '.join(name for name, _ in same)}")
    for topic, table in recording.topics.items():
        known = table.channel in printed
        lines += ["", f"  {topic}: {_span(table)}{', fields as above' if known else ''}"]
        lines.extend([] if known else _field_lines(table.channel))
    printed |= {*recording.metadata.items(), *[one.channel for one in recording.topics.values()]}
    if plain["events"]:
        total, shown = len(recording.topics[EVENT_TOPIC]), len(plain["events"])
        lines += ["", "  events" if shown == total else f"  the first {shown} of {total} events"]
        lines.extend(f"    {_event_line(row)}" for row in plain["events"])
    return "\n".join(lines)


def _metadata_lines(name: str, value: str) -> list[str]:
    """Return one line; for a configuration, which is JSON, one per section."""
    if name == SIGNALS_KEY:
        plant = recorded_signals({name: value})
        kinds = (("states", plant.states), ("inputs", plant.inputs), ("outputs", plant.outputs))
        return [f"  {kind}: {'; '.join(one.label for one in signals)}" for kind, signals in kinds]
    try:
        sections = orjson.loads(value) if value.startswith("{") else None
    except ValueError:
        sections = None
    if not isinstance(sections, dict):
        return [f"  {name} = {value}"]
    lines = [f"  {name}"]
    for section, fields in sections.items():
        if not isinstance(fields, dict):
            lines.append(f"    {section}: {json.dumps(fields)}")
            continue
        values = ", ".join(f"{field} {json.dumps(one)}" for field, one in fields.items())
        lines.append(f"    {section}: {values}")
    return lines


def _span(table: Table) -> str:
    first_s, last_s = table.first_time_ns / 1e9, table.last_time_ns / 1e9
    noun = "row" if len(table) == 1 else "rows"
    return f"{len(table)} {noun}, {first_s:.3f} s to {last_s:.3f} s"


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
    return f"{time}  {row.get('kind', '')}: {events.event_text(row)}{sample}"
