"""The commands to run next, for the nodes that have keys."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

from tenbaud.keys.authority import Certified, NodeRole
from tenbaud.keys.store import NodeKeys

PORT = 7447


def endpoint_of(host: str) -> str:
    """Return the TLS endpoint at a host name or address."""
    return f"tls/[{host}]:{PORT}" if ":" in host else f"tls/{host}:{PORT}"


def next_steps(nodes: Sequence[NodeKeys]) -> str:
    """Return what is still to be added, or the commands for the machines of a whole set."""
    transmitter = _first(nodes, NodeRole.TRANSMITTER)
    receiver = _first(nodes, NodeRole.RECEIVER)
    router = _first(nodes, NodeRole.ROUTER)
    if transmitter is None:
        return "Next: tenbaud keys add rig --role transmitter"
    if receiver is None:
        return "Next: tenbaud keys add desk --role receiver --host ADDRESS   (where the rig reaches it)"
    rig, desk = transmitter.certified, receiver.certified
    at = _place(desk)
    at_rig, at_desk = (quote(str(node.folder)) for node in (transmitter, receiver))
    lines = [
        f"Copy {transmitter.folder} to the rig's machine and {receiver.folder} to the other, over ssh;",
        "they hold private keys. Then:",
        f"  on {desk.name}:  tenbaud receive --keys {at_desk} --peer {rig.name} --listen {at}",
        f"  on {rig.name}:  tenbaud transmit --keys {at_rig} --peer {desk.name} --connect {at}",
    ]
    if router is not None:
        hub = router.certified
        at = _place(hub)
        lines += [
            f"Or, where the two cannot reach each other, through {hub.name}:",
            f"  on {hub.name}:  tenbaud router --keys {quote(str(router.folder))} --listen {at} "
            f"--flight helicopter={rig.name},{desk.name}",
            f"  on {desk.name}:  tenbaud receive --keys {at_desk} --peer {hub.name} --router {at}",
            f"  on {rig.name}:  tenbaud transmit --keys {at_rig} --peer {hub.name} --router {at}",
        ]
    return "\n".join(lines)


def _place(node: Certified) -> str:
    # Brackets around an address of IPv6 mean something to a shell.
    return quote(endpoint_of(node.hosts[0])) if node.hosts else f"tls/ADDRESS:{PORT}"


def _first(nodes: Sequence[NodeKeys], role: NodeRole) -> NodeKeys | None:
    return next((node for node in nodes if node.certified.role is role), None)
