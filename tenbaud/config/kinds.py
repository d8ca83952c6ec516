"""The registries of models, coders, plants and controllers: one line for each kind.

What stands behind a name is a `Kind` (its section of the configuration, and what is built from it) or a
class of the sort that `docs/extend.md` describes, called with a context and its options; the options'
names, types and defaults are then those of its constructor. Plants and controllers may also be
functions of the configuration and the context. Packages offer classes of that sort by entry points.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, Union, get_type_hints

from pydantic import Discriminator, JsonValue, Tag, create_model

from channel.registry import Registry
from tenbaud.config.section import KindSection, OutsideSection

FMU = "fmu"
"""The plant that runs the machine code of a file: code from outside, although its class is built in."""

MODELS = Registry(
    "model.kind",
    "tenbaud.models",
    {
        "pitch": "tenbaud.config.models:PITCH",
        "hold": "tenbaud.config.models:HOLD",
        "pendulum": "tenbaud.config.models:PENDULUM",
        "linear": "tenbaud.config.models:LINEAR",
        "helicopter": "tenbaud.config.helicopter:HELICOPTER",
    },
)
CODERS = Registry(
    "coder.kind",
    "tenbaud.coders",
    {
        "zoom": "tenbaud.config.coders:ZOOM",
        "fixed": "tenbaud.config.coders:FIXED",
        "open-loop-zoom": "tenbaud.config.coders:OPEN_LOOP_ZOOM",
        "static": "tenbaud.config.coders:STATIC",
        "pcm": "tenbaud.config.coders:PCM",
        "history": "tenbaud.config.coders:HISTORY",
        "direction": "tenbaud.config.coders:DIRECTION",
        "learning": "tenbaud.config.coders:LEARNING",
    },
)
PLANTS = Registry(
    "transmitter.plant.kind",
    "tenbaud.plants",
    {
        "pitch": "tenbaud.build.rig:pitch_plant",
        "pendulum": "plant_sim.pendulum:PendulumPlant",
        "linear": "plant_sim.linear:SimulatedLinear",
        "servo": "plant_sim.servo:ServoPlant",
        "furuta": "plant_sim.furuta:FurutaPlant",
        "helicopter": "plant_sim.helicopter:HelicopterPlant",
        FMU: "plant_sim.fmu:FmuPlant",
    },
)
CONTROLLERS = Registry(
    "receiver.controller",
    "tenbaud.controllers",
    {
        "pid": "tenbaud.build.controllers:pid",
        "recorded": "tenbaud.build.controllers:recorded",
        "state_feedback": "tenbaud.build.state_feedback:state_feedback",
    },
)


REGISTRIES = {"model": MODELS, "coder": CODERS, "plant": PLANTS, "controller": CONTROLLERS}


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of model or coder."""

    section: type[KindSection]
    build: Callable[[Any, Any], Any]
    """from the section and the context to the part"""
    plant: str = "pitch"
    """of a model: the kind of the plant that it describes"""
    linear: Callable[[Any], Any] | None = None
    """of a model: from its section to one of the kind `linear`, the plant at rest, which floors,
    designs and the gap gauge are of; None: it describes no plant"""
    may_grow: Callable[[Any], bool] = lambda _section: True
    """of a model with `linear`: whether the plant of a section may be unstable, so that a rate may be
    too low for it"""


@dataclass(frozen=True, slots=True)
class PartName:
    """Checks the name of a kind."""

    registry: Registry
    also: str = ""
    """a name beside those of kinds"""

    def __call__(self, name: str) -> str:
        """Return the name; ValueError where nobody offers it."""
        if self.also and name == self.also:
            return name
        if not self.registry.classes or ":" not in name:
            return self.registry.check(name)
        if not re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*", name):
            raise ValueError("a class from outside is written module:Class")
        return name


def model_kind(section: KindSection) -> Kind | None:
    """Return the kind of a model's section; None for a class that no package offers by name."""
    return None if ":" in section.kind else kind_of(MODELS, section.kind)


@cache
def kind_of(registry: Registry, name: str) -> Kind:
    """Return a kind of model or coder that is built in."""
    found = registry.load(name)
    return found if isinstance(found, Kind) else _kind_of_class(name, found)


def _kind_of_class(name: str, part: Any) -> Kind:
    """Return the kind whose section holds what the constructor takes behind the context."""
    hints = get_type_hints(part.__init__)
    fields: dict[str, Any] = {
        one.name: (hints.get(one.name, JsonValue), ... if one.default is one.empty else one.default)
        for one in list(inspect.signature(part).parameters.values())[1:]
    }
    fields["kind"] = (Literal[name], name)
    section: type[KindSection] = create_model(
        f"{part.__name__}Section", __base__=KindSection, __doc__=inspect.getdoc(part), **fields
    )

    def build(values: KindSection, context: object) -> Any:
        return part(context, **{field: getattr(values, field) for field in fields if field != "kind"})

    return Kind(section, build)


def sections_of(registry: Registry) -> dict[str, type[KindSection]]:
    """Return the section of each kind that is built in."""
    return {name: kind_of(registry, name).section for name in registry.built_in}


def union_of(registry: Registry) -> Any:
    """Return the annotation of a section of any kind; without `kind` it is the first one's."""
    tagged = [Annotated[section, Tag(name)] for name, section in sections_of(registry).items()]
    tagged.append(Annotated[OutsideSection, Tag("plugin")])
    first = next(iter(registry.built_in))

    def tag_of(value: Any) -> str:
        named = value.get("kind", first) if isinstance(value, dict) else getattr(value, "kind", first)
        name = str(named)
        outside = name not in registry.built_in and (":" in name or registry.knows(name))
        return "plugin" if outside else name

    return Annotated[Union[tuple(tagged)], Discriminator(tag_of)]  # noqa: UP007
