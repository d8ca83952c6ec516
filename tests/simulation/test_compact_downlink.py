"""Flights with the compact downlink: bytes, held commands, losses, differences that are found."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import pytest

from channel.codec.codec import Codec, CodecState
from channel.line.line import CleanLine, Delivery
from channel.protocol.compact import PART_SAMPLES
from channel.protocol.frames import Echo, Why
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from channel.protocol.wire import encode, is_short
from tenbaud import MemoryFlight
from tests.channel.codec.parts import pitch_codec
from tests.simulation.flight import assert_lockstep, pitch_flight
from transmitter.session.echoes import EchoFollowing
from transmitter.session.session import TransmitterSession


def compact(**changes: Any) -> MemoryFlight:
    return pitch_flight(mismatch=0.1, downlink="compact", window_start_s=0.0, **changes)


def test_when_it_flies_then_16_bytes_a_sample_go_down_and_a_command_is_held_for_a_sample() -> None:
    flight = compact()
    flight.fly(20.0)
    assert_lockstep(flight, 200)
    assert flight.endpoint.downlink.meter.command_bytes == 200 * 16
    assert flight.loop.endpoint.inlet.meter.command_bytes == 200 * 16
    commands = flight.receiver_rows.column("tick", "command")
    assert len(commands) == 2000
    for first in range(0, 2000, 10):
        assert len(set(commands[first : first + 10])) == 1
    assert len(set(commands)) > 50
    assert commands == flight.transmitter_rows.column("tick", "commanded")


def test_when_commands_are_held_then_the_plant_flies_as_with_one_for_each_tick() -> None:
    rms = []
    for downlink in ("full", "compact"):
        flight = pitch_flight(mismatch=0.1, downlink=downlink, window_start_s=0.0)
        flight.fly(50.0)
        rms.append(flight.node.scores.first.tracking.rms)
    assert rms[1] == pytest.approx(rms[0], rel=0.01)


class LosingDownlink(CleanLine):
    """Loses the command frames that are named, counted from the first; all else arrives."""

    def __init__(self, lost: Collection[int], delays_ns: dict[int, int] | None = None) -> None:
        super().__init__()
        self._lost = lost
        self._delays_ns = delays_ns or {}
        self._frames = 0

    def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
        if not is_short(data):
            return super().carry(data, now_ns)
        number = self._frames
        self._frames += 1
        kept = None if number in self._lost else data
        return [Delivery(now_ns + self._delays_ns.get(number, 0), kept)]


def test_when_no_more_frames_in_a_row_are_lost_than_are_repeated_then_no_rejoin_is_needed() -> None:
    flight = compact(repeats=2, downlink_line=LosingDownlink({0, 1, 20, 40, 41, 60, 62}))
    flight.fly(10.0)
    counts = flight.transmitter.counts
    assert counts["rejoins"] == counts["desyncs"] == 0
    assert counts["confirmed"] == 100
    # Of a sample whose own frame was lost no digest came: not counted, and not written down.
    assert counts["digest_checks"] == 93
    assert [len(text) for text in flight.transmitter_rows.column("sample", "peer_digest")[19:22]] == [
        4,
        0,
        4,
    ]
    assert flight.transmitter.confirmed_state == flight.receiver.state


def test_when_more_frames_in_a_row_are_lost_then_a_rejoin_follows() -> None:
    flight = compact(repeats=2, downlink_line=LosingDownlink({40, 41, 42}))
    flight.fly(10.0)
    assert flight.transmitter.rejoins_asked == {Why.GAP: 1}
    assert flight.transmitter.counts["rejoins"] == 1
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.transmitter.confirmed_state == flight.receiver.state


def test_when_a_samples_own_frame_was_lost_then_its_state_is_not_compared() -> None:
    flight = compact(lead_ticks=3, downlink_line=LosingDownlink((), {20: 210_000_000}))
    compared: list[bool] = []
    session = flight.transmitter
    copies = echo_following(session).copies
    confirm = copies.confirm

    def confirming(*given: Any) -> Any:
        compared.append(session.reliable_state is not None)
        return confirm(*given)

    copies.confirm = confirming  # type: ignore[method-assign]
    flight.fly(4.0)
    # Asked before each sample is confirmed: 0 has nothing before it, and the frame of 20 came last.
    assert [sample for sample, known in enumerate(compared) if not known] == [0, 21]


def test_when_a_frame_is_overtaken_then_its_echo_is_taken_from_the_next_one() -> None:
    flight = compact(downlink_line=LosingDownlink((), {30: 250_000_000}))
    flight.fly(10.0)
    counts = flight.transmitter.counts
    assert (counts["confirmed"], counts["digest_checks"], counts["stale_frames"]) == (100, 99, 1)
    assert counts["rejoins"] == 0


def echo_following(session: TransmitterSession) -> EchoFollowing:
    assert isinstance(session.following, EchoFollowing)
    return session.following


@pytest.mark.parametrize("field", ["range", "angle", "rate"])
@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_either_codec_is_wrong_in_its_last_bit_then_its_first_sample_shows_it(
    end: str, field: str
) -> None:
    wrong = SabotagedCodec(pitch_codec(), parse_sabotage(f"sample=47,field={field}"))
    flight = compact(receiver_codec=wrong if end == "receiver" else None)
    if end == "transmitter":
        echo_following(flight.transmitter).copies.codec = wrong
    flight.fly(10.0)
    assert flight.transmitter.counts["desyncs"] == flight.receiver.counts["desyncs"] == 1
    assert flight.transmitter.desync is not None
    assert flight.transmitter.desync.sample == 47
    assert flight.transmitter.counts["rejoins"] == 1
    assert flight.transmitter.confirmed_state == flight.receiver.state


class OtherDigest(Codec):
    """The same codec, whose digests differ in one bit from a sample on."""

    def __init__(self, codec: Codec, bit: int, sample: int) -> None:
        super().__init__(codec.model, codec.coder, codec.ticks_per_sample)
        self._bit, self._sample = bit, sample

    def digest(self, state: CodecState) -> int:
        return super().digest(state) ^ (state.sample > self._sample) << self._bit


@pytest.mark.parametrize("bit", [0, 15, 19, 40, 63, 18, 16])
def test_when_digests_differ_in_any_one_bit_then_it_is_found_within_16_samples(bit: int) -> None:
    flight = compact(receiver_codec=OtherDigest(pitch_codec(), bit, 33), stop_on_desync=True)
    flight.fly(10.0)
    assert flight.transmitter.desync is not None
    report = flight.transmitter.desync
    assert report.transmitter_digest ^ report.receiver_digest == 1 << bit
    # A low bit in every frame, another in every sixteenth.
    place = (bit - 16) // 3
    assert report.sample == (33 if bit < 16 else 32 + (place or PART_SAMPLES))
    assert report.sample < 33 + PART_SAMPLES
    assert flight.transmitter.counts["desyncs"] == 1


def test_when_frames_are_of_another_session_or_damaged_then_they_count_as_stale_or_malformed() -> None:
    flight = compact()
    flight.fly(2.0)
    session, inlet = flight.transmitter, flight.loop.endpoint.inlet
    assert session.compact is not None
    echo = Echo(20, 0, 0, (0, 0) * 10)
    before = session.counts["stale_frames"]
    for other in (session.session_number + 1, session.session_number + 3):
        frame = inlet.take(encode(session.compact.packed(other, session.epoch, (echo,))))
        assert frame is not None
        assert session.on_frame(frame) == []
    assert session.counts["stale_frames"] == before + 2
    assert inlet.malformed == 0
    message = encode(session.compact.packed(session.session_number, session.epoch, (echo,)))
    assert inlet.take(message) is not None
    assert inlet.take(message[:5] + bytes((message[5] ^ 4,)) + message[6:]) is None
    assert inlet.take(message[:-1]) is None
    assert inlet.malformed == 2
