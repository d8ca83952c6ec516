"""Two receivers behind a router, the rigs spread over them by the names of their sessions."""

from __future__ import annotations

import signal
from pathlib import Path

from channel.links.endpoints import free_endpoint
from tests.tenbaud.processes import finish, start

SHARDS = {"north": ["north/1", "north/2"], "south": ["south/1"]}


def test_when_receivers_share_a_router_then_each_serves_the_names_of_its_shard(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    shared = ["--router", endpoint, "--clock", "virtual", "--json"]
    router = start("router", "--listen", endpoint, "--connections-max", "5", cwd=tmp_path)
    try:
        receivers = [
            start(
                *("receive", "--sessions", f"{shard}/*", "--out", shard, *shared),
                *("--flights", str(len(names))),
                cwd=tmp_path,
            )
            for shard, names in SHARDS.items()
        ]
        rigs = [
            start("transmit", "--session", name, "--duration", "3", *shared, cwd=tmp_path)
            for names in SHARDS.values()
            for name in names
        ]
        flown = [finish(rig) for rig in rigs]
        served = [finish(receiver) for receiver in receivers]
    finally:
        router.send_signal(signal.SIGINT)
        routed = finish(router)
    assert [end.code for end in flown + served] == [0] * 5, [end.err for end in flown + served]
    assert all(end.summary["digest_checks"] == 30 for end in flown)
    for names, end in zip(SHARDS.values(), served, strict=True):
        assert sorted(flight["session"] for flight in end.summary["flights"]) == names
        assert all(flight["samples"] == 30 for flight in end.summary["flights"])
    assert "connections refused: none" in routed.err
