"""The inbox beside its channel: a flood must not keep it from closing."""

from __future__ import annotations

import threading
import time

import zenoh

from channel.links.endpoints import free_endpoint
from channel.links.zenoh.config import zenoh_config, zenoh_settings
from channel.links.zenoh.link import ChannelInbox
from tests.contract.test_links import PATIENCE_S, SILENCE_S

KEY = "tenbaud/full/up/symbol"


def test_when_the_channel_is_full_and_the_waker_waits_in_it_then_it_closes_all_the_same() -> None:
    with zenoh.open(zenoh_config(zenoh_settings("peer", (free_endpoint(),), ()))) as session:
        inbox = ChannelInbox(session, "tenbaud/full/up/*", messages_max=2)
        for _ in range(2):
            session.put(KEY, b"one")
        woken = threading.Event()
        waker = inbox._waker
        put = waker._wake

        def wake() -> None:
            woken.set()
            put()

        waker._wake = wake
        waker.arm(time.monotonic())
        assert woken.wait(PATIENCE_S)
        closing = threading.Thread(target=inbox.close, daemon=True)
        closing.start()
        closing.join(PATIENCE_S)
        if closing.is_alive():
            while inbox._subscriber.try_recv() is not None:
                pass  # lets the session close, so that the test ends
        assert not closing.is_alive()


def test_when_others_put_under_the_waking_key_then_none_is_passed_over() -> None:
    with zenoh.open(zenoh_config(zenoh_settings("peer", (free_endpoint(),), ()))) as session:
        inbox = ChannelInbox(session, "tenbaud/full/up/*")
        try:
            for _ in range(3):
                session.put("tenbaud/full/up/wake", b"")
            session.put(KEY, b"one")
            assert [inbox.get(PATIENCE_S) for _ in range(4)] == [b"", b"", b"", b"one"]
            inbox.wake()
            assert inbox.get(SILENCE_S) is None
        finally:
            inbox.close()
