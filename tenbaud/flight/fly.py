"""A flight in one call, for scripts and notebooks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from channel.errors import TenbaudError

if TYPE_CHECKING:
    from channel.protocol.terms import Clock
    from tenbaud.recording.run import Run


class FlightFailed(TenbaudError):
    """A flight that did not end well; the text says how, and where its recordings are."""


def fly(
    preset: str | None = None,
    *,
    settings: dict[str, Any] | None = None,
    config: str | Path | None = None,
    out: str | Path | None = None,
    link: str = "memory",
    clock: Clock = "virtual",
    draw: bool = False,
) -> Run:
    """Fly once and return the recorded run.

    `settings` are fields by their full names, as with `--set`: `{"duration_s": 20.0,
    "receiver.controller": "mine:Law"}`. With the link "memory" both ends are in this process and the
    flight is as fast as it computes; the others start two processes, as `tenbaud demo` does.
    `out` is a new folder; without it one is made in `runs/`. Raises ConfigError for settings that
    make no flight, and FlightFailed for a flight that did not end well.
    """
    from tenbaud.build.ends import check_parts
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config, nested
    from tenbaud.flight.demo import fly_demo
    from tenbaud.recording.folder import RunFolder, create_run_folder
    from tenbaud.recording.run import Run

    changes = nested({**(settings or {}), "link.kind": link})
    loaded = load_config(preset, None if config is None else Path(config), changes, allow_code=True)
    agreement = agree(loaded, clock)
    check_parts(agreement.config)
    folder = RunFolder(create_run_folder(None, loaded.preset, None if out is None else Path(out)))
    result = fly_demo(agreement, folder, lambda _status: None, draw=draw)
    if result.code:
        said = "\n  ".join([str(result.summary["outcome"]), *result.messages])
        raise FlightFailed(f"{said}\n  the recordings are in {folder.path}")
    return Run(folder.path)
