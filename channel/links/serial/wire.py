"""Frames on a serial line: one byte per symbol, everything else a COBS frame.

A symbol, and one of the narrow downlink, is one byte, from the highest bit to the lowest:

    1 | check | slot | number        for an alphabet of
    1 | c c c | s s s | n            2 symbols
    1 | c c   | s s s | n n          3 and 4
    1 | c c   | s s   | n n n        5 to 8

`number` is the place in the alphabet, 0 or 1 on the way down, `slot` the slot counter modulo 8 or 4.
`check` is the remainder of `slot, number` times x^3 or x^2 by a polynomial, x^3 + x + 1 or x^2 + x + 1,
xor 101 or 10 (binary).
With three check bits any one or two wrong bits of the seven are found, with two any single one. The
xor makes 0x80 and 0xFF, what a disturbed idle line likes to show, no symbols.

All other frames are those of `channel.protocol.wire`; their own CRC-16/CCITT-FALSE, low byte first at
the end, is the CRC of the line; that of compact commands is checked by the session. Between two zeros
they are COBS-encoded, so that a zero is a delimiter wherever it is seen, and a byte is a symbol only
outside such a frame:

    0x00 | COBS of the frame | 0x00

Three additions, which no frame of a flight needs:

* a message that does not end in its own CRC (an envelope of the virtual clock, say) is sent as
  `0xF4 | message | CRC-16`;
* the links' own notices (`channel.links.serial.link`) begin with 0xF3;
* the first COBS code after a delimiter is always below 0x80, so that a symbol after a stray zero is
  not taken for the beginning of a frame. A message without a zero among its first 126 bytes gets one
  in front, which the other end takes away.
"""

from __future__ import annotations

from binascii import crc_hqx

from channel.errors import FrameError
from channel.links.serial.cobs import cobs_decode, cobs_encode
from channel.protocol.frames import DownSymbol, Frame, ShortSymbol, Symbol
from channel.protocol.wire import CRC_START, FRAME_BYTES_MAX, decode, encode, is_short

SYMBOL_MARK = 0x80
NOTICE = 0xF3
WRAPPED = 0xF4
CONTENT_BYTES_MAX = FRAME_BYTES_MAX + 4
STUFFED_BYTES_MAX = CONTENT_BYTES_MAX + CONTENT_BYTES_MAX // 254 + 1

SYMBOLS_MAX = 8
_SPLITS = ((2, 1, 3, 3), (4, 2, 3, 2), (8, 3, 2, 2))
"""largest alphabet, number bits, slot bits, check bits"""
_POLYNOMIAL = {3: 0b1011, 2: 0b111}
_XOR = {3: 0b101, 2: 0b10}
_RESERVED = (0, NOTICE, WRAPPED)


class SerialWire:
    """How frames look on a serial line, for a coder of `alphabet_size` symbols.

    ValueError for an alphabet that does not fit beside the counter and the check bits.
    """

    def __init__(self, alphabet_size: int) -> None:
        if not 2 <= alphabet_size <= SYMBOLS_MAX:
            raise ValueError(
                f"a symbol byte carries one of 2 to {SYMBOLS_MAX} symbols, got {alphabet_size}; use "
                "a smaller alphabet and more symbols per word"
            )
        split = next(split for split in _SPLITS if alphabet_size <= split[0])
        _, self._number_bits, self._slot_bits, self._check_bits = split
        self._alphabet_size = alphabet_size
        self.slot_modulus = 1 << self._slot_bits
        self._symbols: dict[int, ShortSymbol] = {}
        for slot in range(self.slot_modulus):
            for number in range(alphabet_size):
                symbol = ShortSymbol(number, slot, self.slot_modulus)
                self._symbols[self._byte(slot, number)] = symbol

    def encode(self, frame: Frame) -> bytes:
        """Return the message for a frame: one byte for a symbol."""
        if not isinstance(frame, (Symbol, DownSymbol)):
            return encode(frame)
        if not 0 <= frame.number < self._alphabet_size:
            raise ValueError(f"symbol {frame.number} is not one of {self._alphabet_size}")
        return bytes((self._byte(frame.slot % self.slot_modulus, frame.number),))

    def decode(self, data: bytes) -> Frame:
        """Return the frame in a message; a symbol comes without session, epoch and whole slot."""
        if len(data) != 1:
            return decode(data)
        symbol = self.symbol(data[0])
        if symbol is None:
            raise FrameError(f"0x{data[0]:02x} is no symbol: check bits")
        return symbol

    def size(self, data: bytes) -> int:
        return 1 if self.is_symbol(data) else len(stuff(data))

    def symbol(self, byte: int) -> ShortSymbol | None:
        """Return the symbol in a byte, None when mark or check bits are wrong."""
        return self._symbols.get(byte)

    def is_symbol(self, data: bytes) -> bool:
        return len(data) == 1 and data[0] in self._symbols

    def renumbered(self, data: bytes, shift: int, kinds: int) -> bytes:
        """Return a symbol byte of the same slot with another number."""
        symbol = self._symbols[data[0]]
        return bytes((self._byte(symbol.slot_low, (symbol.number + shift) % kinds),))

    def _byte(self, slot: int, number: int) -> int:
        value = slot << self._number_bits | number
        width = self._number_bits + self._slot_bits
        remainder = value << self._check_bits
        for shift in range(width - 1, -1, -1):
            if remainder >> (shift + self._check_bits) & 1:
                remainder ^= _POLYNOMIAL[self._check_bits] << shift
        check = remainder ^ _XOR[self._check_bits]
        return SYMBOL_MARK | check << width | value


def stuff(message: bytes) -> bytes:
    """Return the bytes on the line for a message that is no symbol, delimiters included."""
    own_crc = len(message) > 2 and message[0] not in _RESERVED
    if not own_crc or not (is_short(message) or _is_sealed(message)):
        message = _seal(bytes((WRAPPED,)) + message)
    return _delimit(message)


def stuff_notice(body: bytes) -> bytes:
    """Return the bytes on the line for a notice between two links."""
    return _delimit(_seal(bytes((NOTICE,)) + body))


def unstuff(stuffed: bytes, *, commands: bool = False) -> tuple[bool, bytes]:
    """Return (is it a notice, message) for the bytes between two delimiters.

    `commands`: the direction carries commands; compact ones are returned with their CRC unchecked.
    Raises FrameError with the kind of damage: "COBS" or "checksum".
    """
    try:
        content = cobs_decode(stuffed)
    except ValueError as error:
        raise FrameError("COBS") from error
    if content[:1] == b"\0":
        content = content[1:]
    if commands and is_short(content):
        return False, content
    if not _is_sealed(content):
        raise FrameError("checksum")
    if content[0] == WRAPPED:
        return False, content[1:-2]
    if content[0] == NOTICE:
        return True, content[1:-2]
    return False, content


def _delimit(content: bytes) -> bytes:
    stuffed = cobs_encode(content)
    if stuffed[0] >= SYMBOL_MARK:
        stuffed = cobs_encode(b"\0" + content)
    return b"\0" + stuffed + b"\0"


def _seal(content: bytes) -> bytes:
    return content + crc_hqx(content, CRC_START).to_bytes(2, "little")


def _is_sealed(content: bytes) -> bool:
    if len(content) < 3:
        return False
    return crc_hqx(content[:-2], CRC_START) == int.from_bytes(content[-2:], "little")
