"""A whole file from a recording that was cut by a crash.

Our own commands read a cut recording as it is; other tools start from the index at its end, which a
killed process never wrote.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mcap.writer import CompressionType, Writer

from tenbaud.recording.encoding import channel_schema
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import find_recordings
from tenbaud.recording.reader import MessageStream
from tenbaud.recording.writer import CHUNK_BYTES, END_METADATA, PROFILE, RUN_METADATA

RECOVERED_NOTE = "recovered"


@dataclass(frozen=True, slots=True)
class Recovered:
    """What became of one recording."""

    path: Path
    """the whole file"""
    kept: Path | None
    """where the cut one is now; None: it was whole, and nothing was done"""
    rows: int
    last_time_ns: int

    def __str__(self) -> str:
        if self.kept is None:
            return f"{self.path} is whole; nothing to do"
        return (
            f"{self.path}: {self.rows} rows up to {self.last_time_ns / 1e9:.3f} s; the cut file is "
            f"kept as {self.kept.name}"
        )


def recover(path: Path, output: Path | None = None) -> list[Recovered]:
    """Mend a recording, or each recording of a run folder that was cut.

    The whole file takes the name of the cut one, which is kept beside it as `NAME.cut.mcap`; with
    `output`, which is for a single file, it goes there and the cut one stays as it is. Raises
    RecordingError where there is nothing to recover or no room to write.
    """
    files = find_recordings(path)
    if output is not None and len(files) > 1:
        raise RecordingError(
            f"{path} holds {len(files)} recordings, and --out names one file. Give one recording."
        )
    return [_recover_file(file, output) for file in files]


def _recover_file(path: Path, output: Path | None) -> Recovered:
    target = output or path
    unfinished = target.with_name(f".{target.name}.unfinished")
    kept = None if output is not None else path.with_name(f"{path.stem}.cut{path.suffix}")
    stream = MessageStream(path)
    try:
        rows, last_ns = _copy(stream, unfinished)
        if stream.complete:
            return Recovered(path, None, rows, last_ns)
        for taken in (output, kept):
            if taken is not None and taken.exists():
                raise RecordingError(
                    f"{taken} exists already and is not overwritten. Move it away, or choose another "
                    "place with --out."
                )
        if kept is not None:
            path.rename(kept)
        unfinished.replace(target)
    except OSError as error:
        raise RecordingError(
            f"{target} cannot be written: {error.strerror or error}. Choose another place with --out."
        ) from error
    finally:
        unfinished.unlink(missing_ok=True)
    return Recovered(target, kept or path, rows, last_ns)


def _copy(stream: MessageStream, path: Path) -> tuple[int, int]:
    """Write every message of a stream into a finished file; return their number and last time."""
    rows, last_ns = 0, 0
    channels: dict[str, int] = {}
    with path.open("wb") as output:
        writer = Writer(output, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start(profile=PROFILE, library="tenbaud")
        headed = False
        for topic, time_ns, data in stream.undecoded():
            if not headed:
                headed = True
                writer.add_metadata(RUN_METADATA, stream.metadata.get(RUN_METADATA, {}))
            if topic not in channels:
                channel = stream.channels[topic]
                schema = writer.register_schema(topic, "jsonschema", channel_schema(channel))
                channels[topic] = writer.register_channel(topic, "json", schema)
            writer.add_message(channels[topic], time_ns, data, time_ns)
            rows += 1
            last_ns = max(last_ns, time_ns)
        if not headed:
            writer.add_metadata(RUN_METADATA, stream.metadata.get(RUN_METADATA, {}))
        end = stream.metadata.get(END_METADATA) or {
            "rows_written": str(rows),
            RECOVERED_NOTE: "from a recording that was cut; what came after is lost",
        }
        writer.add_metadata(END_METADATA, end)
        writer.finish()
    return rows, last_ns
