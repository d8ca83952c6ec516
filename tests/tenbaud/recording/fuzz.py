"""Run folders that are nearly ones, or not at all, for everything that reads recordings.

Recordings are changed byte by byte, and row by row with checksums that are right, so that what is
inside is read too; so are configurations and summaries. Only the project's own errors may come out, in
bounded time and memory. `python -m tests.tenbaud.recording.fuzz RUN INPUTS SEED` prints what came.
"""

from __future__ import annotations

import json
import random
import resource
import shutil
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from channel.errors import TenbaudError
from tenbaud import Run
from tenbaud.audit.audit import audit
from tenbaud.recording.convert import convert
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.encoding import channel_schema
from tenbaud.recording.figure import draw_run
from tenbaud.recording.inspect import describe_json, describe_text
from tenbaud.recording.reader import MessageStream
from tenbaud.recording.recover import recover
from tenbaud.replay.pack import MAGIC
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay, replay_symbols
from tenbaud.replay.symbols import unpack
from tests.tenbaud.recording.craft import Message, chunk, mcap_file, messages_of

NAMES = ("transmitter.mcap", "receiver.mcap", "config.toml", "summary.json")
VALUES: tuple[Any, ...] = (
    *(
        None,
        True,
        "",
        "x",
        -1,
        0,
        1,
        3,
        2**31,
        2**53,
        2**63,
        -(2**63),
        2**64,
        10**30,
        1e308,
        -1e308,
        1e-320,
    ),
    *([], {}, [None], [[]], ["x"], [1e308], [2**62, 1], [0.5] * 5, [1] * 70_000, {"a": [1]}),
)
DATA = (
    b"",
    b"{}",
    b"[]",
    b"null",
    b"{",
    b"1e999",
    b"NaN",
    b'{"tick":1},{"tick":2}',
    b"[" * 3000,
    b"\xff",
)


class Original:
    """A run folder whose recordings are taken apart once."""

    def __init__(self, folder: Path) -> None:
        self.files = {name: (folder / name).read_bytes() for name in NAMES}
        self.recordings = {}
        for name in NAMES[:2]:
            stream = MessageStream(folder / name)
            messages = list(stream.undecoded())
            numbers = {topic: number for number, topic in enumerate(stream.channels, 1)}
            self.recordings[name] = (
                [(numbers[topic], topic, channel_schema(stream.channels[topic])) for topic in numbers],
                [(numbers[topic], time_ns, data) for topic, time_ns, data in messages],
                dict(stream.metadata),
            )


def mutated_bytes(chance: random.Random, data: bytes) -> bytes:
    """Return a file changed at one to four places: bits, bytes, length, order."""
    changed = bytearray(data)
    for _ in range(chance.randrange(1, 5)):
        place = chance.randrange(len(changed) + 1)
        match chance.randrange(7):
            case 0 | 1 if changed:
                changed[place % len(changed)] ^= 1 << chance.randrange(8)
            case 2 if changed:
                changed[place % len(changed)] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
            case 3:
                del changed[place:]
            case 4:
                changed[place:place] = chance.randbytes(chance.randrange(1, 9))
            case 5:
                other = chance.randrange(len(data))
                changed[place:place] = data[other : other + chance.randrange(1, 2000)]
            case _:
                del changed[place : place + chance.choice((1, 8, 300))]
    return bytes(changed)


def mutated_rows(chance: random.Random, original: Original, name: str) -> bytes:
    """Return a recording with right checksums and wrong rows, channels or chunks."""
    described, messages, metadata = original.recordings[name]
    described, messages = list(described), list(messages)
    metadata = {key: dict(values) for key, values in metadata.items()}
    for _ in range(chance.randrange(1, 4)):
        place = chance.randrange(len(messages))
        number, time_ns, data = messages[place]
        match chance.randrange(10):
            case 0 | 1 | 2 | 3:
                messages[place] = (number, time_ns, _mutated_row(chance, data))
            case 4:
                messages[place] = (number, time_ns, chance.choice(DATA))
            case 5:
                messages[place] = (chance.choice((0, 2, 65535)), time_ns, data)
            case 6:
                messages[place] = (number, chance.choice((0, 2**63, 2**64 - 1)), data)
            case 7:
                messages[place : place + chance.choice((0, 1, 40))] = [messages[place]] * chance.choice(
                    (0, 2)
                )
                messages = messages or [(number, time_ns, data)]
            case 8:
                at = chance.randrange(len(described))
                one, topic, schema = described[at]
                described[at] = (one, topic, mutated_bytes(chance, schema))
            case _:
                values = metadata[chance.choice(list(metadata))]
                key = chance.choice(list(values))
                values[key] = chance.choice(
                    ("", "x", "-1", "1e400", "{}", "[" * 3000, "nan", values[key] * 2)
                )
    return mcap_file(_chunks(chance, messages), described, list(metadata.items()))


def _mutated_row(chance: random.Random, data: bytes) -> bytes:
    row = json.loads(data) if data[:1] == b"{" and data[-1:] == b"}" and data.count(b"{") == 1 else {}
    if not row:
        return data
    key = chance.choice(list(row))
    match chance.randrange(5):
        case 0:
            del row[key]
        case 1 if isinstance(row[key], list) and row[key]:
            row[key][chance.randrange(len(row[key]))] = chance.choice(VALUES)
        case 2 if isinstance(row[key], list):
            row[key] = row[key] * chance.choice((0, 2, 30))
        case _:
            row[key] = chance.choice(VALUES)
    return json.dumps(row).encode()


def _chunks(chance: random.Random, messages: list[Message]) -> list[bytes]:
    cut = chance.randrange(len(messages))
    body = [
        chunk(messages_of(part), chance.choice(("zstd", "lz4", "")))
        for part in (messages[:cut], messages[cut:])
    ]
    match chance.randrange(12):
        case 0:
            body.append(chunk(b"", "lz4", packed=chance.randbytes(50)))
        case 1:
            body.append(chunk(b"", packed=chance.randbytes(50), size=chance.choice((0, 2**32, 2**63))))
        case 2:
            body.append(chunk(bytes(1 << 22), size=1 << 22, checksum=0))
        case 3:
            body.insert(0, chunk(messages_of([(9, 0, b"{}")] * 2000), checksum=0))
        case 4:
            body.append(messages_of(messages[:3]))
        case _:
            pass
    return body


def _stream(folder: Path) -> None:
    for name in NAMES[:2]:
        for _ in MessageStream(folder / name):
            pass


def _signals(folder: Path) -> None:
    run = Run(folder)
    list(run.signals)
    len(run.events)
    repr(run)


def _inspect(folder: Path) -> None:
    describe_text(folder)
    json.dumps(describe_json(folder))


def _convert(folder: Path) -> None:
    for form in ("csv", "json", "mat", "mcap"):
        convert(Run(folder), form, folder / f"converted.{form}")


def _figure(folder: Path) -> None:
    run = Run(folder)
    draw_run(run.folder.transmitter, run.folder.receiver, "")


def _recover(folder: Path) -> None:
    recover(folder)
    for name in NAMES[:2]:
        stream = MessageStream(folder / name)
        for _ in stream.undecoded():
            pass
        assert stream.complete, "a recovered file is not whole"


QUICK: tuple[Callable[[Path], object], ...] = (_stream, _signals, _inspect)
SLOW: tuple[Callable[[Path], object], ...] = (
    _convert,
    _figure,
    compare_runs,
    audit,
    lambda folder: replay(load_record(folder)),
    _recover,
)

SLOW_EVERY = 24
SYMBOLS_EVERY = 12


def mutated_symbols(chance: random.Random, data: bytes) -> bytes:
    """Return a symbols file changed in its bytes, or in what its packed head says."""
    if chance.random() < 0.3:
        return mutated_bytes(chance, data)
    at = len(MAGIC) + 4
    length = int.from_bytes(data[at - 4 : at], "little")
    head = json.loads(zlib.decompress(data[at : at + length]))
    where = chance.choice((head, head["epochs"], chance.choice(head["epochs"]), head["config"]))
    places = list(where) if isinstance(where, dict) else range(len(where))
    where[chance.choice(places)] = chance.choice(VALUES)
    packed = zlib.compress(json.dumps(head).encode())
    return MAGIC + len(packed).to_bytes(4, "little") + packed + data[at + length :]


def _symbols(path: Path) -> None:
    replay_symbols(unpack(path))


def fuzz(run: Path, inputs: int, seed: int) -> dict[str, Any]:
    """Feed `inputs` run folders to the readers; return counts, the slowest one, memory and faults."""
    chance = random.Random(seed)
    original = Original(run)
    whole_flight = replay(load_record(run)).packed.data
    outcomes: Counter[str] = Counter()
    times_s: list[float] = []
    faults: list[str] = []
    before = 0

    def told(number: int, changed: str, reader: Callable[[Path], object], path: Path) -> None:
        started_s = time.process_time()
        try:
            reader(path)
            outcomes["accepted"] += 1
        except TenbaudError:
            outcomes["refused"] += 1
        except Exception:
            faults.append(f"input {number} of seed {seed}, {changed}: {traceback.format_exc(-4)}")
        times_s.append(time.process_time() - started_s)

    with tempfile.TemporaryDirectory(prefix="tenbaud-fuzz-") as name:
        folder = Path(name) / "run"
        for number in range(inputs):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            files = dict(original.files)
            changed = chance.choice(NAMES[:2]) if chance.random() < 0.9 else chance.choice(NAMES[2:])
            if changed in original.recordings and chance.random() < 0.6:
                files[changed] = mutated_rows(chance, original, changed)
            else:
                files[changed] = mutated_bytes(chance, files[changed])
            for path, data in files.items():
                (folder / path).write_bytes(data)
            readers = [chance.choice(QUICK)] if changed in original.recordings else []
            if number % SLOW_EVERY == 0 or not readers:
                readers.append(SLOW[number // SLOW_EVERY % len(SLOW)])
            for reader in readers:
                told(number, changed, reader, folder)
            if number % SYMBOLS_EVERY == 0:
                symbols = folder / "flight.symbols"
                symbols.write_bytes(mutated_symbols(chance, whole_flight))
                told(number, "flight.symbols", _symbols, symbols)
            if number == inputs // 10:
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {
        "inputs": inputs,
        **outcomes,
        "slowest_s": max(times_s),
        "grown_kib": grown,
        "faults": faults,
    }


if __name__ == "__main__":
    print(json.dumps(fuzz(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
