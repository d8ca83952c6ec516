"""`tenbaud receive --sessions 'rig/*'`: one process that serves every rig whose name matches."""

from __future__ import annotations

import gc
import json
import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tenbaud.cli import options

if TYPE_CHECKING:
    from channel.protocol.terms import Clock
    from receiver.loops.many import ManyService
    from tenbaud.build.flight import Agreement
    from tenbaud.flight.many import ManyHost
    from tenbaud.sentences.flown import Summary


def serve(
    many: options.ManyOptions,
    node: options.NodeOptions,
    addresses: options.Addresses,
    changed: dict[str, Any],
) -> None:
    """Serve until interrupted, or until enough flights have ended; see `docs/many-rigs.md`."""
    from channel.links.zenoh.config import SESSIONS_MAX
    from channel.links.zenoh.hub import ZenohHub
    from receiver.loops.many import ManyService
    from tenbaud.build.ends import check_parts
    from tenbaud.cli.addresses import endpoints_of
    from tenbaud.files.whole import write_whole
    from tenbaud.flight.ends import SWITCH_INTERVAL_S, refusals
    from tenbaud.flight.many import ManyHost
    from tenbaud.flight.many_status import ManyStatus
    from tenbaud.flight.outcome import ExitCode
    from tenbaud.flight.stop import StopFlag
    from tenbaud.flight.trouble import Certificate
    from tenbaud.recording.folder import create_run_folder

    sessions, most = many.sessions or "", math.inf if many.flights is None else many.flights
    agreement_of = agreements(node.preset, node.config, many.configs, changed, node.clock)
    common = agreement_of("")
    if not common.link.serves_many:
        raise typer.BadParameter("--sessions needs Zenoh; other links have one rig at their other end")
    check_parts(common.config)
    where = endpoints_of("receiver", addresses, common.config, sessions=sessions)
    places = ", ".join(where.listen + where.connect + where.router)
    connections_max = max(SESSIONS_MAX, 2 * many.rigs_max)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with (
        StopFlag() as stop,
        refusals(where) as refused,
        ZenohHub(sessions, **where.node(), connections_max=connections_max, should_stop=stop) as hub,
    ):
        certificate = Certificate(where.security)
        root = create_run_folder(None, "receiver-many", node.out)
        lines: list[Callable[[str], None]] = [lambda text: typer.echo(text, err=True)]
        host = ManyHost(hub, agreement_of, root, many.rigs_max, lambda text: lines[-1](text))
        service = ManyService(hub, host)
        lines[-1](
            f"tenbaud {common.identity.version} receiver of {sessions}  config "
            f"{common.identity.config_digest.hex()[:12]}  numerics "
            f"{common.identity.numerics_probe.hex()}\n"
            f"  at {places}, recording below {root}"
        )
        # Objects built so far stay; the collector need not scan them in flight.
        gc.collect()
        gc.freeze()
        try:
            with ManyStatus(service, sessions, shown=not node.json) as status:
                lines.append(status.tell)
                service.run(lambda: stop() or certificate.expired() or len(host.summaries) >= most)
        finally:
            lines[1:] = []
            host.close()
    summary = _summary(host, service, sessions, refused + hub.counts.refused)
    write_whole(root / "summary.json", json.dumps(summary, indent=2) + "\n")
    if node.json:
        options.print_json(summary)
    else:
        _show(host.summaries, root)
    if certificate.expired() and not stop.raised:
        typer.echo(f"tenbaud: {certificate.text()}", err=True)
        raise typer.Exit(int(ExitCode.LINK_LOST))
    if host.counts["not_written"]:
        typer.echo(f"tenbaud: {host.counts['not_written']} files below {root} are not whole", err=True)
        raise typer.Exit(int(ExitCode.NOT_WRITTEN))


def agreements(
    preset: str | None, path: Path | None, configs: Path | None, changed: dict[str, Any], clock: Clock
) -> Callable[[str], Agreement]:
    """Return a function from a session name to its agreement; "" for the one without a separate file.

    A changed file is read again.
    """
    from tenbaud.build.ends import check_parts
    from tenbaud.build.flight import agree
    from tenbaud.build.recorded import flight_config

    known: dict[Path | None, tuple[float, Agreement]] = {}

    def agreement_of(name: str) -> Agreement:
        own = None if configs is None or not name else configs / f"{name}.toml"
        if own is not None and not own.is_file():
            own = None
        changed_s = 0.0 if own is None else own.stat().st_mtime
        if own not in known or known[own][0] != changed_s:
            config = flight_config(
                preset if own is None else None, own or path, changed, allow_code=True
            )
            if own is not None:
                check_parts(config)
            known[own] = (changed_s, agree(config, clock))
        return known[own][1]

    return agreement_of


def _summary(
    host: ManyHost, service: ManyService, sessions: str, turned_away: Mapping[str, int]
) -> Summary:
    return {
        "sessions": sessions,
        "flights": host.summaries,
        "refused": host.counts["refused"],
        "strays": host.counts["strays"],
        "loop_late_ms_p50": service.lateness.percentile_ms(50.0),
        "loop_late_ms_p99": service.lateness.percentile_ms(99.0),
        "turned_away": dict(turned_away),
    }


def _show(summaries: list[Summary], root: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{len(summaries)} flights, in {root}", title_justify="left")
    for name in ("session", "samples", "baud", "erased", "rejoins", "desyncs", "outcome"):
        table.add_column(name, justify="left" if name in ("session", "outcome") else "right")
    for one in summaries:
        baud = one["baud_measured"]
        table.add_row(
            one["session"],
            str(one["samples"]),
            "" if baud is None else f"{baud:.3f}",
            *(str(one[name]) for name in ("erasures", "rejoins", "desyncs")),
            one["outcome"],
        )
    Console().print(table)
