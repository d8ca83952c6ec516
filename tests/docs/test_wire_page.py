"""The wire format's page is decoded byte by byte, from its own tables and nothing else.

Each table is read as an outsider would: the bytes are taken from the page, the field's value is worked
out by the type that the page gives, and the frame that the code makes of them must have that value.
Then each field is changed alone, with a new checksum: that field of the frame changes and no other.
"""

from __future__ import annotations

import re
import struct
from binascii import crc_hqx
from dataclasses import asdict, dataclass
from typing import Any

import pytest

from channel.errors import FrameError
from channel.line.virtual import decode_reply, decode_step
from channel.links.serial.cobs import cobs_decode
from channel.links.serial.wire import SerialWire, unstuff
from channel.protocol import wire
from channel.protocol.frames import ShortCommands, Why
from tests.rules.sources import TOP

PAGE = (TOP / "docs/reference/wire-format.md").read_text(encoding="utf-8")
SERIAL_PAGE = (TOP / "docs/serial.md").read_text(encoding="utf-8")
NUMBERS = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "s16": "<h", "s64": "<q"}
NOT_IN_THE_FRAME = ("version", "kind", "CRC", "echoes", "inputs")
"""Names of the head, and counts that the code takes from the length of a list."""


@dataclass(frozen=True)
class Row:
    offset: int
    data: bytes
    name: str
    type: str
    value: str


def section(title: str, page: str = PAGE) -> str:
    return page.split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]


def rows(title: str) -> list[Row]:
    found = re.findall(
        r"^\| (\d+) \| `([0-9a-f ]*)` \| (\w+) \| ([\w ]+) \| (.*?) \|", section(title), re.MULTILINE
    )
    return [
        Row(int(offset), bytes.fromhex(data), name, kind, value)
        for offset, data, name, kind, value in found
    ]


TITLES = re.findall(r"^## (\d+ \w+(?: symbol)?)$", PAGE, re.MULTILINE)


def shown(row: Row) -> str:
    """Return a field's value as the page writes it, from its bytes and its type."""
    if row.type in NUMBERS:
        number = struct.unpack(NUMBERS[row.type], row.data)[0]
        return f"0x{number:0{2 * len(row.data)}X}" if row.value.startswith("0x") else str(number)
    if row.type == "text":
        assert int.from_bytes(row.data[:2], "little") == len(row.data) - 2
        return f"`{row.data[2:].decode()}`"
    return f"{len(row.data)} bytes"


def values(frame: Any) -> dict[str, Any]:
    """Return a frame's fields, those of its echoes beside each other."""
    found = asdict(frame)
    for index, echo in enumerate(found.pop("echoes", ())):
        found |= {f"{name} {index}": value for name, value in echo._asdict().items()}
    return found


def test_when_the_page_is_read_then_every_kind_of_frame_has_its_table() -> None:
    known = set()
    for kind in range(256):
        head = struct.pack("<BBIH", wire.WIRE_VERSION, kind, 0, 0)
        try:
            wire.decode(head + struct.pack("<H", crc_hqx(head, wire.CRC_START)))
        except FrameError as error:
            if "unknown kind" in str(error):
                continue
        known.add(kind)
    assert {int(title.split()[0]) for title in TITLES} == known
    assert f"| 0 | u8 | wire version, {wire.WIRE_VERSION} |" in PAGE
    assert f"{wire.FRAME_BYTES_MAX:,}".replace(",", " ") in PAGE


@pytest.mark.parametrize("title", TITLES)
def test_when_a_table_is_read_then_it_covers_its_frame_and_says_what_the_bytes_say(title: str) -> None:
    table = rows(title)
    position = 0
    for row in table:
        assert row.offset == position
        assert row.value == shown(row), row
        position += len(row.data)
    message = b"".join(row.data for row in table)
    assert message[1] == int(title.split()[0])
    frame = wire.decode(message)
    assert type(frame).__name__.lower() == "".join(title.split()[1:])
    assert wire.encode(frame) == message


@pytest.mark.parametrize("title", TITLES)
def test_when_one_field_is_changed_then_that_one_changes_in_the_frame(title: str) -> None:
    table = rows(title)
    message = b"".join(row.data for row in table)
    before = values(wire.decode(message))
    for row in table:
        if row.name in NOT_IN_THE_FRAME:
            continue
        changed = bytearray(message)
        changed[row.offset + len(row.data) - 1] ^= 1
        after = values(wire.decode(sealed(changed)))
        different = {name.split(" ")[0] for name in after if after[name] != before.get(name)}
        # A frame that belongs to no session or epoch has zeros there, which nobody reads.
        unread = row.name in ("session", "epoch") and row.name not in before
        assert different == (set() if unread else {row.name}), (row, different)
        assert not unread or not any(row.data)


@pytest.mark.parametrize("title", TITLES)
def test_when_the_head_or_a_count_is_wrong_then_the_frame_is_refused(title: str) -> None:
    for row in rows(title):
        changed = bytearray(b"".join(one.data for one in rows(title)))
        if row.name == "CRC":
            changed[-1] ^= 1
            with pytest.raises(FrameError, match="checksum"):
                wire.decode(bytes(changed))
        elif row.name == "kind":
            changed[row.offset] = 200
            with pytest.raises(FrameError, match="kind"):
                wire.decode(sealed(changed))


def test_when_a_reason_is_looked_up_then_all_are_on_the_page() -> None:
    text = section("1 hello")
    assert all(re.search(rf"\b{int(why)} ", text) for why in Why)


def sealed(message: bytearray) -> bytes:
    body = bytes(message[:-2])
    return body + crc_hqx(body, 0xFFFF).to_bytes(2, "little")


def bits(text: str) -> list[int]:
    return [int(bit) for bit in re.findall(r"\d", text)]


@pytest.mark.parametrize(("page", "title"), [(PAGE, "On a serial line"), (SERIAL_PAGE, "Line format")])
def test_when_the_symbol_byte_is_split_as_the_page_says_then_slot_and_number_come_out(
    page: str, title: str
) -> None:
    table = re.findall(
        r"^\| (\d)(?: symbols?| to \d| or \d)?[^|]*\| 1 \| ([\d, ]+) \| ([^|]+) \| ([\d, ]+) \|",
        section(title, page),
        re.MULTILINE,
    )
    assert len(table) == 3
    for smallest, check, slot, number in table:
        codec = SerialWire(int(smallest))
        places = [bits(cell.split("(")[0]) for cell in (check, slot, number)]
        assert sorted(bit for place in places for bit in place) == list(range(7))
        assert codec.slot_modulus == 2 ** len(places[1])
        for low in range(codec.slot_modulus):
            for symbol in range(int(smallest)):
                byte = codec._byte(low, symbol)
                assert byte >> 7 == 1
                assert taken(byte, places[1]) == low
                assert taken(byte, places[2]) == symbol
                content = low << len(places[2]) | symbol
                assert taken(byte, places[0]) == remainder(content, len(places[0]))


def taken(byte: int, places: list[int]) -> int:
    value = 0
    for place in places:
        value = value << 1 | byte >> place & 1
    return value


def remainder(value: int, width: int) -> int:
    """Divide as the page says: polynomial x^3 + x + 1 or x^2 + x + 1, xor 101 or 10."""
    polynomial, mask = {3: (0b1011, 0b101), 2: (0b111, 0b10)}[width]
    value <<= width
    for shift in range(value.bit_length() - 1, width - 1, -1):
        if value >> shift & 1:
            value ^= polynomial << shift - width
    return value ^ mask


def test_when_the_examples_of_symbol_bytes_are_decoded_then_they_are_right() -> None:
    examples = re.findall(r"^\| (\d) \| (\d) \| (\d) \| `0x(..)` \|", PAGE, re.MULTILINE)
    assert len(examples) == 6
    for size, slot, number, byte in examples:
        symbol = SerialWire(int(size)).symbol(int(byte, 16))
        assert symbol is not None
        assert (symbol.slot_low, symbol.number) == (int(slot), int(number))
    others = re.findall(r"^\| (\d) \| (\d) \| `([01 ]+)` = 0x", SERIAL_PAGE, re.MULTILINE)
    assert len(others) == 4
    for slot, number, written in others:
        symbol = SerialWire(2).symbol(int(written.replace(" ", ""), 2))
        assert symbol is not None
        assert (symbol.slot_low, symbol.number) == (int(slot), int(number))


def test_when_the_framed_example_is_unstuffed_then_it_is_the_frame_above_it() -> None:
    shown_bytes = re.findall(r"```text\n([0-9a-f ]+)\n```", section("On a serial line"))
    plain, framed = (bytes.fromhex(one) for one in shown_bytes)
    assert framed[0] == framed[-1] == 0
    assert framed[1] < 0x80
    assert unstuff(framed[1:-1]) == (False, plain)
    assert plain in cobs_decode(framed[1:-1])
    assert wire.decode(plain) == wire.decode(b"".join(row.data for row in rows("8 unknown")))


def test_when_the_envelopes_are_decoded_then_they_say_what_the_text_says() -> None:
    match = re.search(r"```text\n([0-9a-f ]+)\n([0-9a-f ]+)\n```", section("On the virtual clock"))
    assert match is not None
    step, reply = decode_step(bytes.fromhex(match[1])), decode_reply(bytes.fromhex(match[2]))
    assert (step.number, step.time_ns, step.data) == (5, 700_000_000, b"\x01")
    assert (reply.number, reply.deadline_ns, reply.frames) == (5, 820_000_000, (b"\x01\x02",))


def test_when_the_compact_frames_bits_are_put_together_then_they_are_its_bytes() -> None:
    page = PAGE.split("### Compact commands", 1)[1].split("\n## ", 1)[0]
    shown_bytes = re.search(r"^`([0-9a-f ]+)`$", page, re.MULTILINE)
    assert shown_bytes is not None
    message = bytes.fromhex(shown_bytes[1])
    table = re.findall(r"^\| `([01]+)` \| ([\w ]+) \| (\d+) \|", page, re.MULTILINE)
    assert (
        int("".join(bits for bits, _, _ in table), 2).to_bytes(len(message) - 2, "big") == message[:-2]
    )
    assert [int(bits, 2) for bits, _, _ in table] == [int(value) for _, _, value in table]
    assert wire.decode(message) == ShortCommands(message[:-2], int.from_bytes(message[-2:], "little"))
