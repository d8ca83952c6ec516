"""The page of the wire format: its prose is here, its tables come from frames that the code encodes.

What follows from the code alone (bytes, offsets, values) is computed; what a field is called and meant
for is written down. `tests/docs/test_wire_page.py` decodes the page again, byte by byte.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from channel.codec.codec import Codec
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.line.virtual import Reply, Step, encode_reply, encode_step
from channel.links.serial.wire import SerialWire, stuff
from channel.protocol.compact import CompactForm
from channel.protocol.endings import Ending
from channel.protocol.frames import (
    Bye,
    Claim,
    Commands,
    Desync,
    DownSymbol,
    Echo,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Unknown,
    Welcome,
    Why,
)
from channel.protocol.terms import Terms
from channel.protocol.wire import WIRE_VERSION, encode
from tenbaud.sentences.endings import ending_text

TEXT = Path(__file__).with_name("wire_page.md")

SESSION, EPOCH = 0x1A2B3C4D, 2
DIGEST = 0x1122334455667788


@dataclass(frozen=True, slots=True)
class Field:
    """One row of a table: `type` is u8, u16, u32, u64, s16, s64, `bytes N`, `text` or `rest`."""

    name: str
    type: str
    meaning: str


HEAD = (
    Field("version", "u8", "of the wire format"),
    Field("kind", "u8", "of the frame"),
    Field("session", "u32", "drawn by the receiver; 0: none yet"),
    Field("epoch", "u16", "counts the rejoins of a session"),
)
TAIL = (Field("CRC", "u16", "CRC-16/CCITT-FALSE of all bytes before it"),)

DIGESTS = "of the codec state after the sample"
FRAMES: dict[str, tuple[Frame, tuple[Field, ...]]] = {
    "symbol": (
        Symbol(SESSION, EPOCH, 700, 1),
        (
            Field("slot", "u32", "counted from the first symbol of sample 0"),
            Field(
                "number",
                "u8",
                "place of the symbol in the alphabet; of the paper's, 0 is -1 and 1 is +1",
            ),
        ),
    ),
    "down_symbol": (
        DownSymbol(SESSION, EPOCH, 1401, 1),
        (
            Field("slot", "u32", "counted from the first down symbol of sample 0"),
            Field("number", "u8", "0 or 1"),
        ),
    ),
    "commands": (
        Commands(
            SESSION,
            EPOCH,
            (Echo(699, 0xFFFF, 5, (1500, -1500)), Echo(700, 1, DIGEST, (1480, -1480))),
        ),
        (
            Field("sample", "u32", "that the last echo is of; the others are of the samples before it"),
            Field("echoes", "u8", "how many follow, oldest first"),
            Field("word_number", "u16", "the word consumed for the sample; 65535: it was erased"),
            Field("digest", "u64", DIGESTS),
            Field("steps", "s16", "first input, first tick"),
            Field("steps", "s16", "second input, first tick; then the next tick, `N` in all"),
            Field("word_number", "u16", "the next echo"),
            Field("digest", "u64", DIGESTS),
            Field("steps", "s16", "first input"),
            Field("steps", "s16", "second input"),
        ),
    ),
    "hello": (
        Hello(0xA1B2C3D4, "0.1", bytes(range(16)), bytes(range(8)), 3, SESSION, EPOCH, 710, Why.DESYNC),
        (
            Field("incarnation", "u32", "drawn anew by every process"),
            Field("request", "u32", "counts the times that this process asked"),
            Field("sample", "u32", "first one that the transmitter could still send"),
            Field("why", "u8", "see below"),
            Field("config_digest", "bytes 16", "of the shared configuration"),
            Field("numerics_probe", "bytes 8", "of the codec run over fixed vectors"),
            Field("version", "text", "of the software, for people"),
        ),
    ),
    "welcome": (
        Welcome(SESSION, EPOCH, 713, 0xA1B2C3D4, 3, (1480, -1480), bytes((1, 2, 3, 4))),
        (
            Field("incarnation", "u32", "of the greeting that is answered"),
            Field("request", "u32", "of the greeting that is answered"),
            Field("first_sample", "u32", "symbols start with it"),
            Field("inputs", "u8", "how many values follow; 0: hold the initial command"),
            Field("hold_steps", "s16", "first input, until the first command decided"),
            Field("hold_steps", "s16", "second input"),
            Field("state", "rest", "codec state before `first_sample`; empty: the initial one"),
        ),
    ),
    "refuse": (
        Refuse(0xA1B2C3D4, Ending.MISMATCH, "no", "{}"),
        (
            Field("incarnation", "u32", "of the greeting that is answered"),
            Field("ending", "u8", "see below"),
            Field("text", "text", "for people; may be empty"),
            Field("config", "text", "the receiver's shared configuration as JSON"),
        ),
    ),
    "desync": (
        Desync(SESSION, EPOCH, 700, DIGEST, DIGEST + 1, bytes((1, 2, 3, 4))),
        (
            Field("sample", "u32", "after which the copies differed"),
            Field("transmitter_digest", "u64", ""),
            Field("receiver_digest", "u64", ""),
            Field("state", "rest", "the sender's state after the sample; empty: not kept"),
        ),
    ),
    "bye": (
        Bye(SESSION, Ending.OVER, "done"),
        (
            Field("ending", "u8", "see below"),
            Field("text", "text", "for people; may be empty"),
        ),
    ),
    "unknown": (Unknown(SESSION, EPOCH), ()),
    "claim": (
        Claim(SESSION, EPOCH, 0x5E6F7081),
        (Field("by", "u32", "session of the receiver that takes over"),),
    ),
}


def wire_page() -> str:
    """Return the whole page."""
    text = TEXT.read_text(encoding="utf-8")
    for name, (frame, fields) in FRAMES.items():
        table = "\n".join(_table(encode(frame), (*HEAD, *fields, *TAIL)))
        text = text.replace(f"{{{{{name}}}}}", table)
    message, table = _compact()
    text = text.replace("{{compact_frame}}", _hex(message))
    text = text.replace("{{compact}}", "\n".join(table))
    text = text.replace("{{version}}", str(WIRE_VERSION))
    text = text.replace("{{endings}}", "\n".join(_endings()))
    text = text.replace("{{symbols}}", "\n".join(_symbols()))
    text = text.replace("{{stuffed}}", _hex(stuff(encode(FRAMES["unknown"][0]))))
    text = text.replace("{{unstuffed}}", _hex(encode(FRAMES["unknown"][0])))
    text = text.replace("{{step}}", _hex(encode_step(Step(5, 700_000_000, b"\x01"))))
    return text.replace("{{reply}}", _hex(encode_reply(Reply(5, 820_000_000, (b"\x01\x02",)))))


def _table(message: bytes, fields: tuple[Field, ...]) -> Iterator[str]:
    yield "| offset | bytes | field | type | value | |"
    yield "|---|---|---|---|---|---|"
    offset = 0
    for field in fields:
        size = _size(field, message, offset)
        part = message[offset : offset + size]
        value = _value(field, part)
        yield f"| {offset} | `{_hex(part)}` | {field.name} | {field.type} | {value} | {field.meaning} |"
        offset += size
    if offset != len(message):
        raise ValueError(
            f"the fields cover {offset} of {len(message)} bytes: {[f.name for f in fields]}"
        )


def _compact() -> tuple[bytes, list[str]]:
    """Return a frame of the compact downlink of the paper's flight, and its table of bits."""
    codec = Codec(PitchModel(PitchParameters(), 0.01), ZoomCoder(ZoomParameters()), 10)
    form = CompactForm(codec, Terms.for_codec(codec, 0.01, downlink="compact"))
    steps = ((0, 0), (1500, -1500), (1480, -1480))
    words = (0, 0xFFFF, 1)
    echoes = [
        Echo(698 + place, word, DIGEST, two * 10)
        for place, (word, two) in enumerate(zip(words, steps, strict=True))
    ]
    message = encode(form.packed(SESSION, EPOCH, echoes))
    fields = [
        ("mark", 2, "always 10"),
        ("epoch", 2, f"{EPOCH} modulo 4"),
        ("session", 4, f"0x{SESSION:08X} modulo 16"),
        ("sample", 8, "700 modulo 256"),
        ("digest", 16, f"the low bits of 0x{DIGEST:016X}"),
        ("more of it", 3, "bits 52 to 54: 16 + 3 x (700 modulo 16) and on"),
    ]
    for word, two in zip(reversed(words), reversed(steps), strict=True):
        fields.append(("word", 2, "2: erased" if word == 0xFFFF else f"word number {word}"))
        fields += [("command", 11, f"{one} mV: ({one} + 5000) / 5") for one in two]
    fields.append(("zeros", 5, "up to a whole byte"))
    bits = f"{int.from_bytes(message[:-2], 'big'):0{8 * len(message) - 16}b}"
    table = ["| bits | field | value | |", "|---|---|---|---|"]
    for name, count, meaning in fields:
        part, bits = bits[:count], bits[count:]
        table.append(f"| `{part}` | {name} | {int(part, 2)} | {meaning} |")
    if bits:
        raise ValueError(f"the fields leave {len(bits)} bits")
    return message, table


def _endings() -> Iterator[str]:
    yield "| number | name | |"
    yield "|---|---|---|"
    for ending in Ending:
        yield f"| {ending.value} | `{ending.name.lower()}` | {ending_text(ending)} |"


NUMBERS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "s16": "<h", "s64": "<q"}


def _size(field: Field, message: bytes, offset: int) -> int:
    if field.type in NUMBERS:
        return struct.calcsize(NUMBERS[field.type])
    if field.type == "text":
        return 2 + int.from_bytes(message[offset : offset + 2], "little")
    if field.type == "rest":
        return len(message) - 2 - offset
    return int(field.type.split()[1])


def _value(field: Field, part: bytes) -> str:
    if field.type in NUMBERS:
        number = struct.unpack(NUMBERS[field.type], part)[0]
        large = field.name in ("session", "incarnation", "digest", "CRC", "by") or field.name.endswith(
            "_digest"
        )
        return f"0x{number:0{2 * len(part)}X}" if large else str(number)
    if field.type == "text":
        return f"`{part[2:].decode()}`"
    return f"{len(part)} bytes"


def _symbols() -> Iterator[str]:
    yield "| alphabet | slot | number | byte |"
    yield "|---|---|---|---|"
    for size, cases in ((2, ((0, 0), (0, 1), (1, 0), (7, 1))), (4, ((5, 2),)), (8, ((3, 6),))):
        wire = SerialWire(size)
        for slot, number in cases:
            byte = wire.encode(Symbol(SESSION, EPOCH, slot, number))[0]
            yield f"| {size} | {slot} | {number} | `0x{byte:02X}` |"


def _hex(data: bytes) -> str:
    return data.hex(" ")
