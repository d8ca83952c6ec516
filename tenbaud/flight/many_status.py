"""The terminal view of a receiver that serves many rigs: problems first, and a table.

On a terminal the table is redrawn once a second; what begins, ends or is refused is a separate line
everywhere.
"""

from __future__ import annotations

import re
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table

from receiver.loops.many import ManyService, Served
from receiver.session.session import Phase
from tenbaud.sentences import endings
from tenbaud.sentences.quantities import amount

PERIOD_S = 1.0
LINES_AROUND = 6
"""Lines of the terminal that the table leaves free."""


class ManyStatus:
    """Within a `with`, shows the sessions of a service on standard error; `tell` prints a line."""

    def __init__(self, service: ManyService, pattern: str, shown: bool = True) -> None:
        self._service = service
        self._pattern = pattern
        self._console = Console(stderr=True)
        self._live: Live | None = None
        if shown and self._console.is_terminal:
            self._live = Live(
                get_renderable=self.table,
                console=self._console,
                refresh_per_second=1.0 / PERIOD_S,
                transient=True,
            )

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def tell(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def table(self) -> RenderableType:
        """Return one row per session, those in trouble first, as many as the terminal has room for."""
        served = sorted(self._service.served, key=_calmness)
        room = max(3, self._console.height - LINES_AROUND)
        table = Table(box=None, pad_edge=False)
        for name in (
            "session",
            "phase",
            "time",
            "outputs",
            "M",
            "baud",
            "erased",
            "rejoins",
            "dropped",
        ):
            table.add_column(name, justify="left" if name in ("session", "phase") else "right")
        for one in served[:room]:
            table.add_row(*_row(one))
        late = self._service.lateness.percentile_ms(99.0)
        loop = "" if late is None else f", loop late p99 {late:.2f} ms"
        hidden = f", {len(served) - room} not shown" if len(served) > room else ""
        return Group(f"{len(served)} rigs of {self._pattern}{loop}{hidden}", table)


def _calmness(served: Served) -> tuple[bool, int, list[str]]:
    session = served.endpoint.session
    trouble = session.counts["desyncs"] + session.counts["rejoins"] + served.dropped
    return session.phase is Phase.FLYING, -trouble, _natural(served.name)


def _natural(name: str) -> list[str]:
    """Return a key by which rig/10 comes after rig/9."""
    return [part.zfill(12) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def _row(served: Served) -> tuple[str, ...]:
    session = served.endpoint.session
    baud = session.meter.baud
    state, model = session.state, session.codec.model
    outputs = session.terms.signals.outputs
    values = zip(model.measured(state.model), outputs, strict=True)
    ranges = session.codec.coder.ranges(state.coder)
    return (
        served.name,
        endings.phase_text(session.phase.value),
        f"{state.sample * session.terms.sample_ns / 1e9:.1f} s",
        ", ".join(amount(value, output.unit) for value, output in values),
        ", ".join(amount(one, output.unit, 2) for one, output in zip(ranges, outputs, strict=True)),
        "" if baud is None else f"{baud:.2f}",
        str(session.counts["erasures"]),
        str(session.counts["rejoins"]),
        str(served.dropped),
    )
