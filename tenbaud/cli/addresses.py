"""From the address options of a command to endpoints: missing ones get defaults, or are refused."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from tenbaud.cli import options

if TYPE_CHECKING:
    from pathlib import Path

    from channel.links.base import Role
    from channel.links.security import Credentials, Part, Security
    from tenbaud.config.schema import FlightConfig
    from tenbaud.flight.ends import Endpoints

INSECURE = (
    "tenbaud: --insecure: anybody who reaches this address can read the symbols, command the motors "
    "and stop the flight; there is no encryption and no authentication"
)


def endpoints_of(
    role: Role,
    addresses: options.Addresses,
    config: FlightConfig,
    take_over: bool = False,
    sessions: str | None = None,
) -> Endpoints:
    """Return where an end listens and connects; LinkError or KeysError if that is refused.

    `sessions` is the pattern of session names of an end that serves many.
    """
    from channel.links.endpoints import check_endpoints, default_endpoint, with_protocol
    from tenbaud.build.flight import kind_of_link
    from tenbaud.flight.ends import Endpoints

    listen, connect = tuple(addresses.listen or ()), tuple(addresses.connect or ())
    router = tuple(addresses.router or ())
    security = security_of(role, addresses, sessions or config.link.session)
    if not kind_of_link(config).uses_addresses(config.link):
        if listen or connect or router or addresses.scout:
            raise typer.BadParameter(
                "--listen, --connect, --router and --scout are Zenoh's; a serial line has --port, and "
                "other kinds of link have their fields in [link]"
            )
    elif not listen and not connect and not router and not addresses.scout:
        # Without any address both ends meet on this machine: the receiver listens.
        here = with_protocol(default_endpoint(), "tcp" if security is None else "tls")
        listen = (here,) if role == "receiver" else ()
        connect = () if role == "receiver" else (here,)
    if router and (listen or connect or addresses.scout):
        raise typer.BadParameter("behind a --router there is nothing else to listen on or connect to")
    secured = security is not None
    check_endpoints(listen + connect + router, addresses.insecure, secured, addresses.scout)
    if addresses.insecure and not secured:
        typer.echo(INSECURE, err=True)
    return Endpoints(
        listen,
        connect,
        addresses.insecure,
        router=router,
        scouting=addresses.scout,
        security=security,
        take_over=take_over,
    )


def security_of(role: Role, addresses: options.Addresses, session: str) -> Security | None:
    """Return the credentials of `--keys` with all invited nodes, or None without keys."""
    from channel.links.security import Invited, Security

    if addresses.keys is None:
        if addresses.peer or addresses.viewer:
            raise typer.BadParameter("--peer and --viewer name certificates; they need --keys")
        return None
    other: Part = "receiver" if role == "transmitter" else "transmitter"
    if not addresses.peer:
        raise typer.BadParameter(
            f"--keys without --peer refuses every node; name the {other}'s certificate: --peer NAME"
        )
    own_credentials = credentials_of(addresses.keys, role)
    invited = []
    for peer in addresses.peer:
        name, _, own = peer.partition("=")
        invited.append(Invited(name, other, own or session))
    invited += [Invited(name, "viewer", session) for name in addresses.viewer or ()]
    return Security(own_credentials, tuple(invited))


def credentials_of(keys: Path, role: str) -> Credentials:
    """Return the credentials in a key folder of this role; warn of those that expire soon."""
    from tenbaud.keys.authority import NodeRole
    from tenbaud.keys.store import expiry_warning, usable

    node = usable(keys, NodeRole(role))
    warning = expiry_warning(node)
    if warning is not None:
        typer.echo(f"tenbaud: warning: {warning}", err=True)
    return node.credentials
