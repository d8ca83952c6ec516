"""A complete file from a recording that was truncated or damaged.

Our own commands read a damaged recording as it is; other tools start from the index at its end, which a
killed process never wrote.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

from tenbaud.files.whole import whole_path
from tenbaud.recording.chunk_writer import ChunkWriter
from tenbaud.recording.encoding import END_METADATA, RUN_METADATA, channel_schema
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import find_recordings, in_use
from tenbaud.recording.holes import HOLES_METADATA, Hole, packed_holes
from tenbaud.recording.reader import MessageStream, Recording, open_recording
from tenbaud.recording.writer import CHUNK_BYTES, PROFILE

RECOVERED_NOTE = "recovered"
RECOVERED_TEXT = "from a recording that was cut or damaged; what is missing is lost"
HOLES_SHOWN = 20


@dataclass(frozen=True, slots=True)
class Recovered:
    """The result for one recording."""

    path: Path
    """the whole file"""
    kept: Path | None
    """where the damaged one is now; None: it was whole, and nothing was done"""
    rows: int
    last_time_ns: int
    holes: tuple[Hole, ...] = ()
    strays: int = 0
    """rows that nothing in the file describes"""

    def __str__(self) -> str:
        if self.kept is None:
            return f"{self.path} is whole; nothing to do"
        lines = [
            f"{self.path}: {self.rows} rows up to {self.last_time_ns / 1e9:.3f} s; the damaged file is "
            f"kept as {self.kept.name}"
        ]
        lines += [f"  hole at {hole}" for hole in self.holes[:HOLES_SHOWN]]
        if len(self.holes) > HOLES_SHOWN:
            lines.append(f"  and {len(self.holes) - HOLES_SHOWN} holes more")
        if self.strays:
            lines.append(f"  {self.strays} rows are left out: nothing in the file describes them")
        return "\n".join(lines)


def recover(path: Path, output: Path | None = None) -> list[Recovered]:
    """Recover a recording, or each recording of a run folder that was cut or damaged.

    The whole file takes the name of the damaged one, which is kept beside it as `NAME.cut.mcap`; with
    `output`, which is for a single file, it goes there and the damaged one stays as it is. Raises
    RecordingError where there is nothing to recover, no room to write, a flight that still writes the
    file, or a link in its place.
    """
    files = find_recordings(path)
    if output is not None and len(files) > 1:
        raise RecordingError(
            f"{path} holds {len(files)} recordings, and --out names one file. Give one recording."
        )
    return [_recover_file(file, output) for file in files]


def _recover_file(path: Path, output: Path | None) -> Recovered:
    target = output or path
    kept = None if output is not None else path.with_name(f"{path.stem}.cut{path.suffix}")
    with _held(path) as damaged:
        found = Recording(path)
        if found.complete:
            tables = found.topics.values()
            last_ns = max((table.last_time_ns for table in tables), default=0)
            return Recovered(path, None, sum(map(len, tables)), last_ns)
        for taken in (output, kept):
            if taken is not None and os.path.lexists(taken):
                raise _exists(taken)
        stream = MessageStream(path)
        with whole_path(target) as part:
            with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as whole:
                rows, last_ns = _copy(stream, whole)
                whole.flush()
                os.fsync(whole.fileno())  # where there is no room, the damaged file keeps its name
            part.chmod(os.fstat(damaged.fileno()).st_mode & 0o777)
            if kept is not None:
                _keep(path, kept, damaged)
    return Recovered(target, kept or path, rows, last_ns, tuple(stream.holes), stream.strays)


@contextlib.contextmanager
def _held(path: Path) -> Iterator[BinaryIO]:
    """Open a recording that no flight writes and that is no link; it is locked until it is closed."""
    if path.is_symlink():
        raise RecordingError(
            f"{path} is a link, and recover follows none: it would replace what the link leads to. "
            "Give the recording itself."
        )
    with open_recording(path) as stream:
        if in_use(stream.fileno(), path):
            raise RecordingError(
                f"{path} is in use: a flight still records into it. Its rows can be read meanwhile; "
                "recover it when the flight has ended."
            )
        if not os.path.samestat(os.fstat(stream.fileno()), path.lstat()):
            raise RecordingError(f"{path} was replaced while it was opened. Look at it and try again.")
        yield stream


def _keep(path: Path, kept: Path, damaged: BinaryIO) -> None:
    """Give the damaged file its second name and close it; RecordingError if the name is taken."""
    try:
        kept.hardlink_to(path)
        damaged.close()
    except FileExistsError:
        raise _exists(kept) from None
    except OSError:  # a file system without hard links
        damaged.close()
        path.rename(kept)


def _exists(path: Path) -> RecordingError:
    return RecordingError(
        f"{path} exists already and is not overwritten. Move it away, or choose another place with "
        "--out."
    )


def _copy(stream: MessageStream, output: BinaryIO) -> tuple[int, int]:
    """Write every message of a stream into a finished file; return their number and last time."""
    rows, last_ns = 0, 0
    channels: dict[str, int] = {}
    writer = ChunkWriter(output, CHUNK_BYTES)
    writer.start(profile=PROFILE, library="tenbaud")
    messages = stream.undecoded()
    first = [*islice(messages, 1)]  # the head comes before it
    writer.add_metadata(RUN_METADATA, stream.metadata.get(RUN_METADATA, {}))
    for topic, time_ns, data in chain(first, messages):
        if topic not in channels:
            channels[topic] = writer.register(topic, channel_schema(stream.channels[topic]))
        writer.add_message(channels[topic], time_ns, data)
        rows += 1
        last_ns = max(last_ns, time_ns)
    writer.flush()
    if stream.holes:
        writer.add_metadata(HOLES_METADATA, packed_holes(stream.holes))
    end = stream.metadata.get(END_METADATA, {"rows_written": str(rows)})
    end = {**end, "rows_recovered": str(rows), RECOVERED_NOTE: RECOVERED_TEXT}
    writer.add_metadata(END_METADATA, end)
    writer.finish()
    return rows, last_ns
