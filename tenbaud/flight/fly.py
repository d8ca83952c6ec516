"""A recorded flight in one call, for scripts and notebooks."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from channel.codec.codec import Coder, Model
from channel.errors import TenbaudError
from channel.protocol.terms import Clock, Rung
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from tenbaud.build.codec import build_model
from tenbaud.build.controllers import controller_context
from tenbaud.build.ends import check_parts, check_rig, check_sabotage
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.given import Given, feedback_gains, reference_settings, whole_sections
from tenbaud.build.parts import PartError, Parts
from tenbaud.build.plugins import build_class
from tenbaud.build.recorded import flight_config
from tenbaud.build.rig import plant_context
from tenbaud.build.signals import configured_signals
from tenbaud.config.deprecated import with_current_names
from tenbaud.config.load import OWN, ConfigError, load_config, merged, merged_values, nested
from tenbaud.config.outside_code import object_kind
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.settings import exact_outputs, settings_of
from tenbaud.design.simulated import system_plant
from tenbaud.design.systems import Point, System, is_system, matrices
from tenbaud.flight.demo import fly_demo
from tenbaud.flight.display import StatusDisplay
from tenbaud.flight.drawing import NotebookDrawing
from tenbaud.flight.report import removed_unless_begun
from tenbaud.flight.status import Status
from tenbaud.flight.viewing import ViewOptions
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RunFolder, create_run_folder
from tenbaud.recording.notebook import in_notebook
from tenbaud.recording.run import Run

FIELDS = {
    "model": "model.kind",
    "coder": "coder.kind",
    "plant": "transmitter.plant.kind",
    "controller": "receiver.controller",
}
"""The setting that names each part."""
REFERENCE_NAME = "reference.csv"


class FlightFailed(TenbaudError):
    """A flight that did not end well; the text says how; `run` is what was recorded, if anything."""

    def __init__(self, text: str, folder: Path) -> None:
        self.run: Run | None = None
        with suppress(RecordingError):
            self.run = Run(folder)
        where = (
            f"the folder of the run is {folder}"
            if self.run is None
            else f"the recordings are in {folder}"
        )
        super().__init__(f"{text}\n  {where}")


def fly(
    preset: str | System | None = None,
    *,
    rate_baud: float | None = None,
    controller: Controller | Callable[..., Controller] | ArrayLike | str | None = None,
    reference: Given | None = None,
    operating_point: Point | None = None,
    settings: dict[str, Any] | None = None,
    config: str | Path | None = None,
    out: str | Path | None = None,
    link: str = "memory",
    clock: Clock = "virtual",
    downlink: Rung | None = None,
    draw: bool = False,
    model: Model | str | None = None,
    coder: Coder | str | None = None,
    plant: Plant | Callable[..., Plant] | str | None = None,
    show: bool = False,
    pace: float | None = None,
    accept_risk: bool = False,
) -> Run:
    """Fly once, a preset or a plant of your own, and return the recorded run.

    `preset` is a name, or a plant: a `StateSpace` of python-control or scipy, continuous or discrete,
    or a `NonlinearIOSystem`, which the codecs predict as linearised at `operating_point` (x0, u0) and
    which flies as it is. A plant flies at `rate_baud` (10 without) by the coder `direction`.

    `controller` is a matrix K, for u = -K x and what holds the set-points; an object or a class; or a
    name as in the configuration, "pid" or "mine:Law". Without it K is designed for a plant. `reference`
    is the set-point of the first output or of each: a number, an array with a row for each tick, a pair
    (times, values), a function of the time in seconds; or a table by the names of the outputs.

    `settings` are fields by their full names, as with `--set`: `{"duration_s": 20.0, "coder.decay":
    0.9}`. `downlink` is the channel's: "narrow" sends single bits. `model`, `coder` and `plant` take
    the place of the configured part: a name as in the configuration, or an object that you build for
    the tick that is flown; a class of a plant is called with its context. With the link "memory" both
    ends are in this process and the flight is as fast as it computes; the others start two processes
    and take names only. `out` is a new folder; without it one is made in `runs/`. `accept_risk`: turn
    the motors of a real rig without the limits of a first flight (docs/rigs).

    `show`: in a notebook, draw the flight below its cell while it flies, with a progress bar; elsewhere
    and for a flight of two processes, open the live page in the browser, from which it may be steered.
    `pace`: on the virtual clock, at most this many times real time; the page has 1 if it is not given.

    Raises ConfigError for plants, settings and parts that make no flight, and FlightFailed for a flight
    that did not end well.
    """
    settings = {**(settings or {}), **({"channel.downlink": downlink} if downlink else {})}
    if _are_gains(controller):
        settings["receiver.state_feedback.gains"] = feedback_gains(controller)
        controller = "state_feedback"
    parts = {"model": model, "coder": coder, "plant": plant, "controller": controller}
    parts = {name: part for name, part in parts.items() if part is not None}
    changes = nested({**settings, **_names(parts, link), "link.kind": link})
    point = (rate_baud, operating_point)
    loaded, parts = _loaded(preset, None if config is None else Path(config), changes, parts, point)
    folder = RunFolder(create_run_folder(None, loaded.preset, None if out is None else Path(out)))
    with removed_unless_begun(folder):
        if reference is not None:
            loaded = _following(loaded, reference, parts, folder)
        agreement = _agreement(loaded, clock, parts, accept_risk)
        looks = _looks(agreement, show, pace)
    with StatusDisplay() if show and sys.stderr.isatty() else nullcontext() as display:
        on_status = display.show if display is not None else _unseen
        result = fly_demo(agreement, folder, on_status, draw=draw, status="none", **looks)
    if result.code:
        texts = dict.fromkeys([str(result.summary["outcome"]), *result.messages])
        raise FlightFailed("\n  ".join(texts), folder.path)
    return Run(folder.path)


def _unseen(status: Status) -> None:
    """Show nothing."""


def _looks(agreement: Agreement, show: bool, pace: float | None) -> dict[str, Any]:
    """Return how a flight is to be looked at, checked before anything starts."""
    if pace is not None and (agreement.clock == "real" or not pace > 0.0):
        raise ConfigError(
            "pace slows the virtual clock down: a factor above 0, and not for clock='real'"
        )
    if show and agreement.link.in_process and in_notebook():
        return {"drawing": NotebookDrawing(agreement), "pace": pace}
    if not show:
        return {"pace": pace}
    from tenbaud.view.server import require_nicegui

    require_nicegui()
    view = ViewOptions(0, open_browser=True)
    return {"view": view, "pace": pace or (1.0 if agreement.clock == "virtual" else None)}


def _are_gains(controller: object) -> bool:
    """Return whether a controller is a matrix, and not a name, a class or an object."""
    return isinstance(controller, int | float | list | tuple) or hasattr(controller, "__array__")


def _names(parts: Mapping[str, Any], link: str) -> dict[str, str]:
    """Return the settings that name each part."""
    objects = [name for name, part in parts.items() if not isinstance(part, str)]
    if objects and link != "memory":
        raise PartError(
            f"{', '.join(objects)}: an object stays in this process, and the link {link!r} starts two "
            'others; use link="memory", or name a class as "module:Class"'
        )
    return {
        FIELDS[name]: part if isinstance(part, str) else object_kind(part)
        for name, part in parts.items()
    }


def _loaded(
    preset: Any, config: Path | None, changes: dict[str, Any], parts: dict[str, Any], plant: Any
) -> tuple[FlightConfig, dict[str, Any]]:
    """Return the configuration, complete if it is of a system, and the parts that are flown.

    `plant` is what only a system has: rate and operating point.
    """
    if is_system(preset):
        if config is not None:
            raise ConfigError("config describes a plant of its own; lay settings= over this one")
        rate_baud, point = plant
        found = matrices(preset, point)
        changes = with_current_names(changes, "the settings")
        if not found.linear and "plant" not in parts:
            parts = {**parts, "plant": preset}
            changes = merged(changes, nested(_names(parts, changes["link"]["kind"])))
        own = merged(settings_of(found, rate_baud, changes), changes)
        own = merged(exact_outputs(own["model"], changes), own)
        designed = completed(merged_values(OWN, None, own))
        # Whatever was designed: what is given stays as it is given.
        preset, changes = OWN, merged(designed, changes)
    elif any(one is not None for one in plant):
        raise ConfigError("rate_baud and operating_point are for a plant; a preset says them itself")
    elif not isinstance(preset, str | None):
        raise ConfigError(f"a {type(preset).__name__} is neither the name of a preset nor a plant")
    return flight_config(preset, config, changes, allow_code=True), parts


def _following(
    loaded: FlightConfig, reference: Given, parts: Mapping[str, Any], folder: RunFolder
) -> FlightConfig:
    """Return the configuration with other set-points; values over time are in a file in the folder."""
    controller = parts.get("controller")
    if not (controller is None or isinstance(controller, str) or inspect.isclass(controller)):
        raise PartError(
            f"the controller ({type(controller).__name__}) is an object with set-points of its own; "
            "reference= is for a class, which gets them in its context"
        )
    tick_s = loaded.timing.tick_s
    outputs = configured_signals(loaded, _objects(parts)).outputs
    section = reference_settings(
        reference,
        outputs,
        round(loaded.duration_s / tick_s),
        tick_s,
        folder.path / REFERENCE_NAME,
    )
    values = loaded.model_dump(mode="json", exclude_none=True)
    over = {"receiver": {"reference": whole_sections(section, outputs[0].name)}}
    followed = load_config(loaded.preset, None, merged(values, over), allow_code=True)
    return followed.giving(loaded.given)


def _objects(parts: Mapping[str, Any]) -> Parts:
    """Return the parts that are objects already, checked."""
    made = {
        name: part
        for name, part in parts.items()
        if not (isinstance(part, str) or is_system(part) or _is_built(name, part))
    }
    found = Parts(**made)
    found.check()
    return found


def _is_built(name: str, part: object) -> bool:
    """Return whether a part is a class that is called with its context."""
    return name in ("plant", "controller") and inspect.isclass(part)


def _agreement(
    loaded: FlightConfig, clock: Clock, parts: Mapping[str, Any], accept_risk: bool
) -> Agreement:
    """Return what both ends share, with every part built and checked."""
    plant, controller = parts.get("plant"), parts.get("controller")
    objects = _objects(parts)
    if inspect.isclass(controller):
        try:
            asked = controller_context(loaded, build_model(loaded, objects))
        except ValueError as error:
            raise ConfigError(str(error)) from error
        built = build_class("the controller", controller, asked, {}, Controller)
        objects = replace(objects, controller=built, has_own_set_points=False)
    agreement = agree(loaded, clock, objects)
    made = agreement.parts
    context = plant_context(loaded, loaded.timing.tick_s, agreement.signals)
    if is_system(plant):
        made = replace(made, plant=system_plant(plant, context))
    elif inspect.isclass(plant):
        made = replace(made, plant=build_class("the plant", plant, context, {}, Plant))
    agreement = replace(agreement, parts=made)
    check_parts(loaded, made)
    check_sabotage(agreement)
    check_rig(loaded, accept_risk, made)
    return agreement
