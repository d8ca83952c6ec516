"""What only the serial link has: ports, exclusive use, noise on the line, a plug that comes out."""

from __future__ import annotations

import os
import socket
import stat
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from channel.errors import LinkError
from channel.links.serial.link import SerialLink
from channel.links.serial.wire import SerialWire, stuff, stuff_notice
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, DownSymbol, Symbol
from channel.protocol.wire import encode
from tests.channel.links.serial.noisy_line import NoisyLine
from tests.contract.test_links import PATIENCE_S, SILENCE_S, until

WIRE = SerialWire(2)
NOTICE_BYTES = len(stuff_notice(b"?"))
FRAME = encode(Bye(1, Ending.OVER, "a frame as any other"))


def symbol(slot: int) -> bytes:
    return WIRE.encode(Symbol(1, 0, slot, slot % 2))


@pytest.fixture
def line(tmp_path: Path) -> Iterator[NoisyLine]:
    with NoisyLine(tmp_path, None) as emulated:
        yield emulated


@pytest.fixture
def ends(line: NoisyLine) -> Iterator[tuple[SerialLink, SerialLink]]:
    with (
        SerialLink("transmitter", str(line.transmitter_port), WIRE) as transmitter,
        SerialLink("receiver", str(line.receiver_port), WIRE) as receiver,
    ):
        assert until(transmitter.peer_present)
        assert until(receiver.peer_present)
        yield transmitter, receiver


def test_when_a_symbol_is_sent_then_it_is_one_byte_on_the_line(
    line: NoisyLine, ends: tuple[SerialLink, SerialLink]
) -> None:
    transmitter, receiver = ends
    for slot in range(20):
        transmitter.send(symbol(slot))
        assert receiver.receive(PATIENCE_S) == symbol(slot)
    assert until(lambda: line.carried("up") == transmitter.counts.line_bytes_out)
    # Beside the symbols a question on opening and an answer to the other's, which may come late.
    assert line.carried("up") - 20 in (NOTICE_BYTES, 2 * NOTICE_BYTES)


def test_when_a_frame_is_sent_then_its_size_is_what_the_wire_says(
    line: NoisyLine, ends: tuple[SerialLink, SerialLink]
) -> None:
    ends[1].send(FRAME)
    assert ends[0].receive(PATIENCE_S) == FRAME
    assert WIRE.size(FRAME) == len(FRAME) + 3
    assert until(lambda: line.carried("down") == ends[1].counts.line_bytes_out)
    assert line.carried("down") - WIRE.size(FRAME) in (NOTICE_BYTES, 2 * NOTICE_BYTES)


@pytest.mark.parametrize(
    ("noise", "kind"),
    [
        (b"\x42", "garbage byte"),
        (b"\x80", "check bits"),
        (b"\0\0", "stray zero"),
        (stuff(FRAME)[:10] + b"\0", "COBS"),
        (stuff(FRAME).replace(b"any", b"all"), "checksum"),
    ],
    ids=["garbage", "check bits", "break", "half frame", "changed frame"],
)
def test_when_noise_is_on_the_line_then_it_is_counted_and_the_next_messages_come(
    line: NoisyLine, ends: tuple[SerialLink, SerialLink], noise: bytes, kind: str
) -> None:
    transmitter, receiver = ends
    line.inject("up", noise)
    assert until(lambda: receiver.counts.dropped[kind] > 0)
    transmitter.send(symbol(7))
    transmitter.send(FRAME)
    transmitter.send(symbol(0))
    came = [receiver.receive(PATIENCE_S) for _ in range(3)]
    assert came == [symbol(7), FRAME, symbol(0)]
    assert receiver.receive(SILENCE_S) is None


def test_when_it_is_unplugged_and_plugged_in_again_then_both_ends_come_back(
    line: NoisyLine, ends: tuple[SerialLink, SerialLink]
) -> None:
    line.unplug()
    for end in ends:
        assert until(lambda end=end: not end.peer_present())  # type: ignore[misc]
        end.send(FRAME)
        assert end.counts.dropped["unplugged"] >= 1
        assert end.receive(SILENCE_S) is None
    line.plug()
    for end in ends:
        assert until(end.peer_present)
        assert end.counts.reconnects == 1
    ends[0].send(symbol(3))
    assert ends[1].receive(PATIENCE_S) == symbol(3)
    ends[1].send(FRAME)
    assert ends[0].receive(PATIENCE_S) == FRAME


def test_when_it_is_closed_while_unplugged_then_it_closes(
    line: NoisyLine, ends: tuple[SerialLink, SerialLink]
) -> None:
    line.unplug()
    for end in ends:
        assert until(lambda end=end: not end.peer_present())  # type: ignore[misc]
        end.close()


def test_when_the_other_end_is_a_plain_program_then_presence_is_only_what_was_heard(
    line: NoisyLine,
) -> None:
    with ExitStack() as stack:
        plain = os.open(line.receiver_port, os.O_RDWR | os.O_NOCTTY)
        stack.callback(os.close, plain)
        link = stack.enter_context(
            SerialLink("transmitter", str(line.transmitter_port), WIRE, quiet_s=0.2)
        )
        assert not link.peer_present()
        os.write(plain, stuff(FRAME))
        assert until(link.peer_present)
        assert until(lambda: not link.peer_present())


def test_when_the_port_is_gone_after_a_message_then_the_message_is_there() -> None:
    """A serial server sends a farewell and closes: its last byte and the end come together."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with SerialLink("transmitter", url, WIRE) as link:
            peer, _ = server.accept()
            with peer:
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                peer.sendall(stuff(FRAME)[:-1])
                assert until(lambda: link.counts.line_bytes_in == len(stuff(FRAME)) - 1)
                peer.sendall(stuff(FRAME)[-1:])
            assert link.receive(PATIENCE_S) == FRAME


def test_when_a_symbol_has_waited_too_long_then_it_is_dropped(line: NoisyLine) -> None:
    with (
        SerialLink("transmitter", str(line.transmitter_port), WIRE) as transmitter,
        SerialLink("receiver", str(line.receiver_port), WIRE, symbol_age_max_s=0.0) as receiver,
    ):
        assert until(transmitter.peer_present)
        transmitter.send(symbol(1))
        transmitter.send(FRAME)
        assert receiver.receive(PATIENCE_S) == FRAME
        assert receiver.counts.dropped["stale symbol"] == 1


def test_when_the_line_is_far_behind_then_a_symbol_does_not_follow(line: NoisyLine) -> None:
    with SerialLink(
        "transmitter", str(line.transmitter_port), WIRE, line_rate_baud=300, symbol_age_max_s=0.4
    ) as link:
        link.send(encode(Bye(1, Ending.OVER, "fifty bytes of farewell take more than a second")))
        link.send(symbol(1))
        assert link.counts.dropped == {"stale symbol": 1}


def test_when_the_downlink_is_narrow_then_its_symbols_and_frames_come_to_the_transmitter(
    line: NoisyLine,
) -> None:
    with (
        SerialLink("transmitter", str(line.transmitter_port), WIRE, is_narrow=True) as transmitter,
        SerialLink("receiver", str(line.receiver_port), WIRE, is_narrow=True) as receiver,
    ):
        assert until(transmitter.peer_present)
        sent = [WIRE.encode(DownSymbol(1, 0, slot, slot % 3 % 2)) for slot in range(20)]
        sent.insert(7, FRAME)
        for message in sent:
            receiver.send(message)
        assert [transmitter.receive(PATIENCE_S) for _ in sent] == sent


def test_when_the_line_is_slow_then_a_long_message_is_not_repeated_at_once(
    line: NoisyLine,
) -> None:
    with (
        SerialLink("transmitter", str(line.transmitter_port), WIRE, line_rate_baud=300) as transmitter,
        SerialLink("receiver", str(line.receiver_port), WIRE, line_rate_baud=300) as receiver,
    ):
        for _ in range(5):
            transmitter.send(FRAME)
        assert transmitter.counts.dropped == {"repeated too soon": 4}
        assert receiver.receive(PATIENCE_S) == FRAME
        assert receiver.receive(SILENCE_S) is None
        # Nothing but what was sent: no notices on such a line.
        assert until(lambda: line.carried("up") == WIRE.size(FRAME))
        assert line.carried("down") == 0


def test_when_the_line_falls_far_behind_then_more_is_dropped_and_counted(line: NoisyLine) -> None:
    with SerialLink("transmitter", str(line.transmitter_port), WIRE, line_rate_baud=300) as link:
        for number in range(20):
            link.send(encode(Bye(number, Ending.OVER, "thirty bytes a second, no more")))
        assert link.counts.dropped["line busy"] > 10


@pytest.mark.parametrize("port", ["", "nowhere"])
def test_when_there_is_no_port_then_it_is_a_link_error_that_names_it(port: str, tmp_path: Path) -> None:
    path = port and str(tmp_path / port)
    with pytest.raises(LinkError, match=path or "--port"):
        SerialLink("receiver", path, WIRE)


def test_when_another_has_the_port_then_it_is_a_link_error(line: NoisyLine) -> None:
    with (
        SerialLink("receiver", str(line.receiver_port), WIRE),
        pytest.raises(LinkError, match="another program"),
    ):
        SerialLink("receiver", str(line.receiver_port), WIRE)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to the superuser")
def test_when_the_port_is_not_allowed_then_the_group_is_named(line: NoisyLine) -> None:
    os.chmod(line.receiver_port, 0)
    try:
        with pytest.raises(LinkError, match="dialout"):
            SerialLink("receiver", str(line.receiver_port), WIRE)
    finally:
        os.chmod(line.receiver_port, stat.S_IRUSR | stat.S_IWUSR)


@pytest.mark.parametrize("port", ["socket://192.0.2.1:7000", "rfc2217://example.org:7000"])
def test_when_a_port_is_on_another_machine_then_it_is_refused_unless_insecure(port: str) -> None:
    with pytest.raises(LinkError, match="--insecure"):
        SerialLink("receiver", port, WIRE)


def test_when_the_port_is_a_socket_then_frames_and_symbols_pass() -> None:
    """A device server on the network, here this test, which hands back what it gets."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with SerialLink("receiver", f"socket://127.0.0.1:{port}", WIRE) as link:
            peer, _ = server.accept()
            with peer:
                peer.sendall(symbol(4) + stuff(FRAME))
                assert link.receive(PATIENCE_S) == symbol(4)
                assert link.receive(PATIENCE_S) == FRAME
                link.send(FRAME)
                heard = b""
                while stuff(FRAME) not in heard:
                    heard += peer.recv(1000)
            assert until(lambda: not link.peer_present())  # hung up
            peer, _ = server.accept()  # and called again by the link
            with peer:
                peer.recv(1000)  # its question: pyserial forgets what came while it opened the port
                peer.sendall(stuff(FRAME))
                assert link.receive(PATIENCE_S) == FRAME
                assert link.counts.reconnects >= 1


def test_when_the_port_is_a_loop_then_the_link_hears_itself() -> None:
    with SerialLink("receiver", "loop://", WIRE) as link:
        link.send(FRAME)
        assert link.receive(PATIENCE_S) == FRAME


def test_when_nothing_comes_then_closing_does_not_wait_for_it(line: NoisyLine) -> None:
    link = SerialLink("receiver", str(line.receiver_port), WIRE)
    time.sleep(SILENCE_S)
    link.close()
    with pytest.raises(LinkError):
        link.send(FRAME)
