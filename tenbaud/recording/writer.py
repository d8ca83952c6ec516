"""Writes a flight into an MCAP file from a separate thread.

The flight only appends to a queue. The thread takes the rows out ten times a second, encodes them
and writes them in chunks; what a killed process loses is the chunk that was
still open, at most one second. Trouble with the disk ends the recording, never the flight.
"""

from __future__ import annotations

import os
import stat
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple, Self

from channel.protocol.recording import RecordChannel
from tenbaud.recording.chunk_writer import ChunkWriter
from tenbaud.recording.encoding import (
    END_METADATA,
    OVERVIEW_METADATA,
    RUN_METADATA,
    channel_schema,
    row_encoder,
)
from tenbaud.recording.folder import open_new_recording
from tenbaud.recording.shared import SharedWriter

if TYPE_CHECKING:
    from tenbaud.recording.overview import OverviewRecorder

PROFILE = "tenbaud"

POLL_PERIOD_S = 0.1
# Together with one poll period and the time of a batch this stays below the promised second.
FLUSH_PERIOD_S = 0.8
# A damaged byte costs a chunk: here some ten seconds of a flight at 100 Hz.
CHUNK_BYTES = 1 << 18
# While a batch is written, a loop waits for the interpreter each time that it sends, receives or wakes,
# some six times a tick. In real time a batch is therefore shorter than a fast flight's tick, and the
# pause after it lets the loop run.
BATCH_ROWS = 200
REAL_TIME_BATCH_ROWS = 20
SHARED_BATCH_ROWS = 50
BATCH_PAUSE_S = 0.0005
FULL_PAUSE_S = 0.002
CLOSE_TIMEOUT_S = 10.0


class McapRecorder:
    """A `channel.protocol.recording.Recorder` that writes one MCAP file.

    `metadata` describes the run (text to text) and is stored in the file's head. A row handed to
    `write` must not be changed afterwards, nor the lists in it: it is encoded later. Rows come
    from one thread, the loop's.
    """

    def __init__(
        self,
        path: Path,
        metadata: dict[str, str],
        queue_limit: int = 65536,
        wait_when_full: bool = False,
        shared: SharedWriter | None = None,
        overview: OverviewRecorder | None = None,
    ) -> None:
        """Create the file; raises RecordingError if that is impossible or it holds data.

        `wait_when_full` is for flights in virtual time only, which a wait does not disturb and
        which can outrun the disk: `write` then waits for room instead of dropping the row.
        `shared` is a thread that writes for many recorders, in place of one of its own. `overview`
        gathers what the figure of a long flight shows, and is stored at the end of the file.
        """
        self.path = path
        self._queue: deque[tuple[RecordChannel, int, Sequence[object]]] = deque()
        self._queue_limit = queue_limit
        self._wait_when_full = wait_when_full
        in_real_time = REAL_TIME_BATCH_ROWS if shared is None else SHARED_BATCH_ROWS
        self._batch_rows = BATCH_ROWS if wait_when_full else in_real_time
        self._dropped_at_queue = 0
        self._dropped_in_thread = 0
        self.rows_written = 0
        """that the operating system has, so that a killed process keeps them"""
        self._rows_unflushed = 0
        self._metadata = metadata
        self._overview = overview
        self.error: str | None = None
        """the first trouble met, for a person"""
        self.cause: Exception | None = None
        """why the recording ended early"""
        self._failed = False
        self._writers: dict[int, _ChannelWriter] = {}
        self._stream = open_new_recording(path)
        self._writer = ChunkWriter(self._stream, CHUNK_BYTES)
        self._flushed_s = time.monotonic()
        self._closing = threading.Event()
        self._writing = threading.Lock()
        self._open = False
        self._finished = threading.Event()
        if shared is not None:
            shared.add(self.attend)
        else:
            name = f"record {path.name}"
            threading.Thread(target=self._run, name=name, daemon=True).start()

    @property
    def rows_dropped(self) -> int:
        """Rows lost: the queue was full, the disk failed, or a row could not be encoded.

        After `close` these and `rows_written` are all the rows there were.
        """
        return self._dropped_at_queue + self._dropped_in_thread

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Queue one row; drop and count it if the queue is full or the recorder is closed."""
        if len(self._queue) >= self._queue_limit and not self._wait_for_room():
            self._dropped_at_queue += 1
            return
        self._queue.append((channel, time_ns, row))

    def help_out(self) -> None:
        """Write a batch of what is queued in the caller's thread.

        For a loop that waits for its peer anyway, as on the virtual clock: rows written in that time
        do not contend with the loop for the interpreter later.
        """
        if self._queue and self._writing.acquire(blocking=False):
            try:
                if self._open:
                    self._guard(self._write_batch)
            finally:
                self._writing.release()

    def finish_soon(self) -> None:
        """Take no more rows, and have the file finished by the thread."""
        # Later rows meet a full queue, so that they are counted and the thread can finish.
        self._queue_limit = 0
        self._closing.set()

    def close(self) -> None:
        """Write the queued rows, finish the file and stop the thread. May be called again."""
        self.finish_soon()
        if not self._finished.wait(CLOSE_TIMEOUT_S):
            self._note(
                f"The recording {self.path} was not finished within {CLOSE_TIMEOUT_S:g} s; the "
                "disk does not answer. What was written before can still be read."
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _wait_for_room(self) -> bool:
        while self._wait_when_full and not self._finished.is_set() and not self._closing.is_set():
            time.sleep(FULL_PAUSE_S)
            if len(self._queue) < self._queue_limit:
                return True
        return False

    # Everything below runs in the thread, but for batches that the loop writes itself.

    def _run(self) -> None:
        while self.attend():
            self._closing.wait(POLL_PERIOD_S)

    def attend(self) -> bool:
        """Write the queued rows, from the writing thread; return False once it has finished."""
        if not self._open:
            self._guard(self._write_head)
            self._open = True
        closing = self._closing.is_set()
        self._drain()
        if closing:
            with self._writing:
                self._open = False
                self._finish()
            self._finished.set()
        return not closing

    def _write_head(self) -> None:
        self._writer.start(profile=PROFILE, library="tenbaud")
        self._writer.add_metadata(RUN_METADATA, self._metadata)
        self._flush()

    def _drain(self) -> None:
        # Rows that arrive meanwhile are taken too, so a full queue empties before the next poll.
        while True:
            with self._writing:
                self._guard(self._write_batch)
                if time.monotonic() - self._flushed_s >= FLUSH_PERIOD_S:
                    self._guard(self._flush)
            waiting = len(self._queue)
            if not waiting:
                return
            # With the queue half full losing rows is the worse evil, and at the end nobody is held up.
            if waiting < self._queue_limit // 2 and not self._closing.is_set():
                time.sleep(BATCH_PAUSE_S)

    def _write_batch(self) -> None:
        queue = self._queue
        for _ in range(min(self._batch_rows, len(queue))):
            channel, time_ns, row = queue.popleft()
            if self._failed:
                self._dropped_in_thread += 1
                continue
            try:
                # By identity: a channel's hash would be computed anew, field by field, per row.
                entry = self._writers.get(id(channel)) or self._register(channel)
                data = entry.encode(row)
            except (TypeError, ValueError, AttributeError) as error:
                self._dropped_in_thread += 1
                self._note(_bad_row_text(self.path, channel, row, error))
                continue
            self._rows_unflushed += 1
            # MCAP times are unsigned; what happens before tick 0 is filed at zero.
            log_time_ns = time_ns if time_ns > 0 else 0
            self._writer.add_message(entry.channel_id, log_time_ns, data)
            if self._overview is not None:
                self._overview.write(channel, log_time_ns, row)

    def _register(self, channel: RecordChannel) -> _ChannelWriter:
        number = self._writer.register(channel.topic, channel_schema(channel))
        entry = self._writers[id(channel)] = _ChannelWriter(channel, number, row_encoder(channel))
        return entry

    def _flush(self) -> None:
        if self._failed:
            return
        self._writer.flush()
        self._flushed_s = time.monotonic()
        self.rows_written += self._rows_unflushed
        self._rows_unflushed = 0

    def _finish(self) -> None:
        self._guard(self._flush)
        if not self._failed:
            self._guard(self._write_end)
        if not self._failed:
            self._guard(self._sync)
        # After a failure the stream still holds bytes that it cannot write, and says so again.
        self._guard(self._stream.close)

    def _sync(self) -> None:
        # Some file systems find out here that there was no room.
        if stat.S_ISREG(os.fstat(self._stream.fileno()).st_mode):
            self._stream.flush()
            os.fsync(self._stream.fileno())

    def _write_end(self) -> None:
        counts = {"rows_written": str(self.rows_written), "rows_dropped": str(self.rows_dropped)}
        if self.error is not None:
            counts["error"] = self.error
        overview = self._overview.metadata() if self._overview is not None else None
        if overview is not None:
            self._writer.add_metadata(OVERVIEW_METADATA, overview)
        self._writer.add_metadata(END_METADATA, counts)
        self._writer.finish()

    def _guard(self, action: Callable[[], None]) -> None:
        try:
            action()
        # Anything at all: an exception that left this thread would end it without a word.
        except Exception as error:
            self._failed = True
            self.cause = self.cause or error
            self._dropped_in_thread += self._rows_unflushed
            self._rows_unflushed = 0
            cause, advice = repr(error), "Please report this as a fault of tenbaud."
            if isinstance(error, OSError):
                cause = error.strerror or cause
                advice = "Free some space or choose another folder for the next run."
            self._note(
                f"The recording {self.path} stopped: {cause}. The flight goes on unrecorded. {advice}"
            )

    def _note(self, text: str) -> None:
        if self.error is None:
            self.error = text


class _ChannelWriter(NamedTuple):
    """The thread's data about one channel. It holds the channel so that its id stays in use."""

    channel: RecordChannel
    channel_id: int
    encode: Callable[[Sequence[object]], bytes]


def _bad_row_text(path: Path, channel: RecordChannel, row: Sequence[object], error: Exception) -> str:
    return (
        f"A row of {channel.topic!r} could not be recorded in {path} ({error}): {row!r:.200}. "
        "Its values must be plain numbers, texts, lists of numbers or None, one per field."
    )
