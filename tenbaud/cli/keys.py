"""`tenbaud keys`: a private authority, and a certificate for every node of a lab."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from channel.links.endpoints import DEFAULT_PORT
from tenbaud.cli.flags import Command, Group

if TYPE_CHECKING:
    from tenbaud.keys.authority import Certified
    from tenbaud.keys.store import NodeKeys

app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="""Keys for a flight between two machines.

    [dim]tenbaud keys init[/dim]

    [dim]tenbaud keys add rig --role transmitter[/dim]

    [dim]tenbaud keys add desk --role receiver --host 10.0.0.2[/dim]
    """,
)

Folder = Annotated[Path, typer.Option("--folder", help="Folder of the authority and the nodes.")]
Hosts = Annotated[
    list[str] | None,
    typer.Option("--host", help="Address or name at which others connect to it; repeatable."),
]
Days = Annotated[float, typer.Option(help="Validity of the certificate in days.", min=0.01, max=3650.0)]
Name = Annotated[str, typer.Argument(help="Name of the node, such as rig.")]
DEFAULT_FOLDER = Path("keys")


@app.command(cls=Command)
def init(folder: Folder = DEFAULT_FOLDER) -> None:
    """Make the authority that signs the nodes' certificates; once, on one machine."""
    from tenbaud.keys.store import create_authority

    made = create_authority(folder)
    typer.echo(f"{made}: the authority, valid for ten years. It never leaves this machine.")
    typer.echo(next_steps(()))


@app.command(cls=Command)
def add(
    name: Name,
    role: Annotated[str | None, typer.Option(help="transmitter, receiver, router or viewer.")] = None,
    host: Hosts = None,
    days: Days = 365.0,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Make key and certificate of one node, and print the commands for the two machines."""
    from tenbaud.keys.authority import NodeRole
    from tenbaud.keys.store import add_node, read_nodes

    if role not in list(NodeRole):
        known = ", ".join(NodeRole)
        raise typer.BadParameter(f"--role says what {name} is for: {known}", param_hint="--role")
    node = add_node(folder, name, NodeRole(role), tuple(host or ()), days)
    typer.echo(_line(node))
    typer.echo(next_steps(read_nodes(folder)))


@app.command(cls=Command)
def renew(name: Name, host: Hosts = None, days: Days = 365.0, folder: Folder = DEFAULT_FOLDER) -> None:
    """Renew a node's key and certificate, expired or not; then copy its folder again."""
    from tenbaud.keys.store import renew_node

    node = renew_node(folder, name, tuple(host or ()), days)
    typer.echo(_line(node))
    typer.echo(f"Copy {node.folder} to its machine again, and start its end again there.")


@app.command(cls=Command)
def show(
    folder: Annotated[
        Path, typer.Argument(help="Folder of all keys, or of one node.")
    ] = DEFAULT_FOLDER,
) -> None:
    """List the nodes, their expiry dates, and the commands for the two machines."""
    from tenbaud.keys.store import KeysError, expiry_warning, read_node, read_nodes

    nodes = [read_node(folder)] if (folder / "node.pem").exists() else read_nodes(folder)
    if not nodes and not (folder / "authority").exists():
        raise KeysError(f"there are no keys in {folder}; `tenbaud keys init` makes an authority")
    for node in nodes:
        typer.echo(_line(node))
        warning = expiry_warning(node)
        if warning is not None:
            typer.echo(f"  warning: {warning}", err=True)
    if (folder / "authority").exists():
        typer.echo(next_steps(nodes))


def _line(node: NodeKeys) -> str:
    certified = node.certified
    at = f", reached at {', '.join(certified.hosts)}" if certified.hosts else ""
    return (
        f"{node.folder}: {certified.name}, {certified.role}, valid until "
        f"{certified.expires:%Y-%m-%d} ({certified.days_left():.0f} days){at}"
    )


def endpoint_of(host: str) -> str:
    """Return the TLS endpoint at a host name or address."""
    return f"tls/[{host}]:{DEFAULT_PORT}" if ":" in host else f"tls/{host}:{DEFAULT_PORT}"


def next_steps(nodes: Sequence[NodeKeys]) -> str:
    """Return the next node to add, or the commands for the machines of a whole set."""
    transmitter = _first(nodes, "transmitter")
    receiver = _first(nodes, "receiver")
    router = _first(nodes, "router")
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
    return quote(endpoint_of(node.hosts[0])) if node.hosts else f"tls/ADDRESS:{DEFAULT_PORT}"


def _first(nodes: Sequence[NodeKeys], role: str) -> NodeKeys | None:
    return next((node for node in nodes if node.certified.role == role), None)
