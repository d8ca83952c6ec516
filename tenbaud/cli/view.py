"""`tenbaud view`: a page of a flight in the browser, live or from its recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tenbaud.cli import options

if TYPE_CHECKING:
    from tenbaud.view.feed import Feed
    from tenbaud.view.server import Address

Host = Annotated[
    str | None,
    typer.Option(
        help="Address of the page; others than loopback need --insecure. Not given: 127.0.0.1, or "
        "::1 where there is no IPv4."
    ),
]


def view(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RUN",
            help="Folders of finished runs, up to four of the same outputs, or recordings: the page "
            "replays them, laid over each other. Not given: a live flight.",
        ),
    ] = None,
    connect: Annotated[
        list[str] | None,
        typer.Option(
            help="Telemetry endpoint of an end (its --telemetry); repeatable. Not given: flights of "
            "this user on this machine are found."
        ),
    ] = None,
    keys: Annotated[
        Path | None, typer.Option(help="This viewer's key folder (`tenbaud keys`), for tls endpoints.")
    ] = None,
    session: Annotated[str, typer.Option(help="Session name; any if not given.")] = "**",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0: any free one.")] = 8710,
    host: Host = None,
    open_browser: options.OpenBrowser = False,
    insecure: Annotated[
        bool, typer.Option(help="Allow other machines to reach the page, which is not encrypted.")
    ] = False,
    view_only: Annotated[
        bool, typer.Option("--view-only", help="Print only the view-only address.")
    ] = False,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of the telemetry and end.")
    ] = False,
) -> None:
    """Serve a page of a flight, for the browser: picture, curves, bits, lockstep, controls.

    With RUN the same page replays finished flights: scrub, play at any speed, compare. Of a live
    flight two addresses are printed: one that can control the flight, if the flight allows it, and one
    that is view-only. Each contains a secret; requests without it are refused.

    [dim]tenbaud demo --view[/dim]

    [dim]tenbaud view runs/at-10 runs/at-1000 --open[/dim]

    [dim]tenbaud view --connect tcp/127.0.0.1:7448 --connect tcp/127.0.0.1:7449[/dim]

    [dim]tenbaud view --keys keys/desk --connect tls/10.0.0.2:7448[/dim]
    """
    if schema:
        from tenbaud.telemetry.schema import schema_json

        options.print_json(schema_json())
        return
    from channel.links.endpoints import loopback_host
    from tenbaud.view.server import Address

    # As in a URL, or bare.
    host = loopback_host() if host is None else host.removeprefix("[").removesuffix("]")
    address = Address(host, port, insecure)
    if runs:
        if connect or keys or session != "**":
            raise typer.BadParameter(
                "--connect, --keys and --session are for live flights; give no RUN"
            )
        _replay(runs, address, open_browser)
        return
    feed = _feed(tuple(connect or ()), session, keys)
    from tenbaud.view.server import serve

    serve(feed, address, open_browser=open_browser, view_only=view_only)


def _feed(connect: tuple[str, ...], session: str, keys: Path | None) -> Feed:
    from channel.links.endpoints import check_endpoints
    from channel.links.zenoh.hub import is_session_pattern
    from tenbaud.flight.stop import Interruptions
    from tenbaud.view.feed import Feed

    if not is_session_pattern(session):
        raise typer.BadParameter(
            f"--session {session!r}: a session's name as in rig/7, with * for any one part"
        )
    credentials = None
    if keys is not None:
        from tenbaud.cli.addresses import credentials_of

        credentials = credentials_of(keys, "viewer")
    protected = tuple(one for one in connect if not one.startswith("unixsock"))
    check_endpoints(protected, insecure=True, secured=credentials is not None)
    Interruptions.require_none()
    return Feed(connect, session, credentials)


def _replay(runs: list[Path], address: Address, open_browser: bool) -> None:
    from tenbaud.flight.stop import Interruptions
    from tenbaud.recording.run import Run
    from tenbaud.view.recorded import recorded_flights
    from tenbaud.view.replay import serve_recorded

    # What is wrong with the port is said before minutes of recordings are read.
    address = address.checked()
    flights = recorded_flights([Run(one) for one in runs])
    Interruptions.require_none()
    serve_recorded(flights, address, open_browser=open_browser)
