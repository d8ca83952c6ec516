"""Recordings of long flights, made in seconds: rows laid into chunks without a recorder or a flight."""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, DataEnd, Footer, Header, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from channel.protocol.recording import RecordChannel
from receiver.session import records as receiver
from tenbaud.recording.encoding import END_METADATA, RUN_METADATA, channel_schema
from transmitter.session import records as transmitter

TICKS_PER_CHUNK = 2000
TICK_S = 0.01
PER_SAMPLE = 10

_HEAD = struct.Struct("<BQHIQQ")
_CHUNK_HEAD = struct.Struct("<BQQQQII4sQ")


def long_recording(path: Path, ticks: int, end: str = "transmitter") -> Path:
    """Write the recording of a flight of that number of ticks at 100 Hz over 10 bit/s."""
    builder = RecordBuilder()
    Header("tenbaud", "tenbaud").write(builder)
    Metadata(RUN_METADATA, {"role": end, "tick_s": repr(TICK_S), "clock": "virtual"}).write(builder)
    channels: tuple[RecordChannel, ...] = (
        (transmitter.TICK_CHANNEL, transmitter.ESTIMATE_CHANNEL, transmitter.SAMPLE_CHANNEL)
        if end == "transmitter"
        else (receiver.TICK_CHANNEL, receiver.SAMPLE_CHANNEL)
    )
    for number, channel in enumerate(channels, 1):
        Schema(number, channel_schema(channel), "jsonschema", channel.topic).write(builder)
        Channel(number, channel.topic, "json", {}, number).write(builder)
    rows = _transmitter_rows if end == "transmitter" else _receiver_rows
    pool = zstandard.ZstdCompressor(level=1)
    with path.open("wb") as stream:
        stream.write(MCAP0_MAGIC + builder.end())
        for first in range(0, ticks, TICKS_PER_CHUNK):
            data = b"".join(rows(range(first, min(ticks, first + TICKS_PER_CHUNK))))
            packed = pool.compress(data)
            length = _CHUNK_HEAD.size - 9 + len(packed)
            head = (0x06, length, 0, 0, len(data), zlib.crc32(data), 4, b"zstd", len(packed))
            stream.write(_CHUNK_HEAD.pack(*head) + packed)
        Metadata(END_METADATA, {"rows_written": "0", "rows_dropped": "0"}).write(builder)
        DataEnd(0).write(builder)
        Footer(0, 0, 0).write(builder)
        stream.write(builder.end() + MCAP0_MAGIC)
    return path


def _message(channel: int, tick: int, text: str) -> bytes:
    data = text.encode()
    time_ns = tick * 10_000_000
    return _HEAD.pack(int(Opcode.MESSAGE), 22 + len(data), channel, 0, time_ns, time_ns) + data


def pitch_rad(tick: int) -> float:
    """The pitch of the flight."""
    return 0.3 * math.sin(tick * 0.003) + 0.05 * math.sin(tick * 0.41)


def _transmitter_rows(ticks: range) -> list[bytes]:
    rows = []
    for tick in ticks:
        pitch = pitch_rad(tick)
        coded = pitch + 0.02 * math.sin(tick * 0.7)
        rows.append(
            _message(
                1,
                tick,
                f'{{"tick":{tick},"time_s":{tick * TICK_S},"measured":[{pitch}],'
                f'"true":[{pitch}],'
                '"commanded":[0.5,-0.5],"applied":[0.5,-0.5],"late":false,'
                '"lateness_ms":0.1,"guard":"running"}',
            )
        )
        states = f'"coded_state":[{coded},0.25,{coded},0.5],"live_state":[{coded},0.5,{coded},0.25]'
        rows.append(_message(2, tick, f'{{"tick":{tick},{states}}}'))
        if tick % PER_SAMPLE == 0:
            word = 1 if coded < pitch else -1
            rows.append(
                _message(
                    3,
                    tick,
                    f'{{"sample":{tick // PER_SAMPLE},"word_sent":[{word}],"word":[{word}],'
                    '"range":[0.1],'
                    f'"state":[{coded},0.1],"coder":[0.1,1.0],"digest":"{tick:016x}",'
                    f'"peer_digest":"{tick:016x}","lag_samples":1}}',
                )
            )
    return rows


def _receiver_rows(ticks: range) -> list[bytes]:
    rows = []
    for tick in ticks:
        text = f'{{"tick":{tick},"reference":[{0.3 * math.sin(tick * 0.003)}],'
        rows.append(_message(1, tick, text + '"live_state":[0.1,0.2],"command":[0.5,-0.5]}'))
        if tick % PER_SAMPLE == 0:
            text = f'{{"sample":{tick // PER_SAMPLE},"word":[1],"range":[0.1],"state":[0.1,0.2],'
            text += f'"coder":[0.1,1.0],"digest":"{tick:016x}","arrival_s":{tick * TICK_S}}}'
            rows.append(_message(2, tick, text))
    return rows
