"""`tenbaud router`: a Zenoh router in this process, for small labs and tests."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tenbaud.cli import options
from tenbaud.cli.spread import spread

if TYPE_CHECKING:
    from channel.links.security import Invited, Security
    from channel.links.zenoh.router import ZenohRouter

POLL_S = 0.2
TELL_S = 1.0


@dataclass(frozen=True, slots=True)
class RouterOptions:
    """Who may connect, and where."""

    listen: options.Listen = None
    flight: list[str] | None = None
    """With --keys: SESSION=TRANSMITTER,RECEIVER[,VIEWER ...] by the names in their certificates;
    repeatable."""
    keys: Path | None = None
    """This router's key folder."""
    insecure: options.Insecure = False
    connections_max: Annotated[int, typer.Option(min=1, max=100_000)] = 64
    """Maximum number of connected nodes: rigs, receivers, viewers."""
    print_config: bool = False
    """Print the settings for zenohd and exit."""


@spread
def router(given: RouterOptions) -> None:
    """Route between two ends that cannot reach each other but both reach this machine.

    [dim]tenbaud router --keys keys/hub --listen tls/10.0.0.9:7447 --flight helicopter=rig,desk[/dim]

    The ends connect with `--router tls/10.0.0.9:7447 --peer hub`.
    """
    from channel.links.endpoints import check_endpoints, default_endpoint, with_protocol
    from channel.links.zenoh.router import router_file
    from tenbaud.cli.addresses import INSECURE

    security = _security(given.keys, given.flight or [])
    protocol = "tcp" if security is None else "tls"
    addresses = tuple(given.listen or [with_protocol(default_endpoint(), protocol)])
    check_endpoints(addresses, given.insecure, security is not None)
    if given.insecure and security is None:
        typer.echo(INSECURE, err=True)
    if given.print_config:
        typer.echo(router_file(addresses, security, given.connections_max), nl=False)
        return
    _route(addresses, security, given.insecure, given.connections_max)


def _security(keys: Path | None, flights: list[str]) -> Security | None:
    from channel.links.security import Security
    from tenbaud.cli.addresses import credentials_of

    if keys is None:
        if flights:
            raise typer.BadParameter("--flight names certificates; it needs --keys")
        return None
    if not flights:
        raise typer.BadParameter(
            "--keys without --flight refuses every node: --flight SESSION=TRANSMITTER,RECEIVER"
        )
    return Security(
        credentials_of(keys, "router"), tuple(one for text in flights for one in _invited(text))
    )


def _route(
    addresses: tuple[str, ...], security: Security | None, insecure: bool, connections_max: int
) -> None:
    from channel.links.zenoh.gate import HandshakeLog
    from channel.links.zenoh.router import ZenohRouter
    from tenbaud.flight.stop import StopFlag

    with (
        StopFlag() as stop,
        HandshakeLog() as log,
        ZenohRouter(
            addresses, security=security, insecure=insecure, connections_max=connections_max
        ) as running,
    ):
        typer.echo(f"tenbaud router at {', '.join(addresses)}", err=True)
        _tell_until(stop, running)
        refused = running.refused + log.refused
    counted = ", ".join(f"{count} {reason}" for reason, count in refused.items())
    typer.echo(f"tenbaud router: stopped; connections refused: {counted or 'none'}", err=True)


def _tell_until(stop: Callable[[], bool], running: ZenohRouter) -> None:
    shown, next_s = -1, 0.0
    while not stop():
        time.sleep(POLL_S)
        if time.monotonic() >= next_s:
            next_s = time.monotonic() + TELL_S
            count = running.connected
            if count != shown:
                shown = count
                typer.echo(f"tenbaud router: {count} connected", err=True)


def _invited(text: str) -> list[Invited]:
    from channel.links.security import Invited

    session, equals, names = text.partition("=")
    parts = [name.strip() for name in names.split(",")]
    if not equals or not session or len(parts) < 2 or not all(parts):
        raise typer.BadParameter(f"--flight {text}: write SESSION=TRANSMITTER,RECEIVER[,VIEWER ...]")
    transmitter, receiver, *viewers = parts
    invited = [Invited(transmitter, "transmitter", session), Invited(receiver, "receiver", session)]
    return invited + [Invited(viewer, "viewer", session) for viewer in viewers]
