"""A recorded flight in one call, for scripts and notebooks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from channel.errors import TenbaudError

if TYPE_CHECKING:
    from channel.codec.codec import Coder, Model
    from channel.protocol.terms import Clock
    from plant_sim.plant import Plant
    from receiver.controllers.base import Controller
    from tenbaud.build.parts import Parts
    from tenbaud.recording.run import Run

FIELDS = {
    "model": "model.kind",
    "coder": "coder.kind",
    "plant": "transmitter.plant.kind",
    "controller": "receiver.controller",
}
"""The setting that names each part."""


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
    model: Model | str | None = None,
    coder: Coder | str | None = None,
    plant: Plant | str | None = None,
    controller: Controller | str | None = None,
) -> Run:
    """Fly once and return the recorded run.

    `settings` are fields by their full names, as with `--set`: `{"duration_s": 20.0,
    "coder.decay": 0.9}`. `model`, `coder`, `plant` and `controller` take the place of the configured
    part: an object, or a name as in the configuration, "pid" or "mine:Law". An object is built by you,
    for the tick that is flown; a plant and a controller fly once. With the link "memory" both ends are
    in this process and the flight is as fast as it computes; the others start two processes, as
    `tenbaud demo` does, and take names only. `out` is a new folder; without it one is made in `runs/`.

    Raises ConfigError for settings and parts that make no flight, and FlightFailed for a flight that
    did not end well.
    """
    from tenbaud.build.ends import check_parts
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config, nested
    from tenbaud.flight.demo import fly_demo
    from tenbaud.recording.folder import RunFolder, create_run_folder
    from tenbaud.recording.run import Run

    given = {"model": model, "coder": coder, "plant": plant, "controller": controller}
    names, parts = _names_and_objects(given, link)
    changes = nested({**(settings or {}), **names, "link.kind": link})
    loaded = load_config(preset, None if config is None else Path(config), changes, allow_code=True)
    agreement = agree(loaded, clock, parts)
    check_parts(agreement.config, parts)
    folder = RunFolder(create_run_folder(None, loaded.preset, None if out is None else Path(out)))
    result = fly_demo(agreement, folder, lambda _status: None, draw=draw)
    if result.code:
        said = "\n  ".join([str(result.summary["outcome"]), *result.messages])
        raise FlightFailed(f"{said}\n  the recordings are in {folder.path}")
    return Run(folder.path)


def _names_and_objects(given: dict[str, Any], link: str) -> tuple[dict[str, str], Parts]:
    """Return the settings that name each part, and the parts that are objects, checked."""
    from tenbaud.build.parts import PartError, Parts
    from tenbaud.config.outside_code import object_kind

    given = {name: part for name, part in given.items() if part is not None}
    objects = {name: part for name, part in given.items() if not isinstance(part, str)}
    parts = Parts(**objects)
    parts.check()
    if objects and link != "memory":
        raise PartError(
            f"{', '.join(objects)}: an object stays in this process, and the link {link!r} starts two "
            'others; use link="memory", or name a class as "module:Class"'
        )
    kinds = {name: object_kind(part) if name in objects else part for name, part in given.items()}
    return {FIELDS[name]: kind for name, kind in kinds.items()}, parts
