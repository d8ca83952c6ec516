"""Checks of external parts, given as objects or as classes named in the configuration.

What a part must have is read from its protocol (`Model`, `Coder`, `Plant`, `Controller`), so that the
protocol is the one place that says it. A part that lacks something is refused before anything moves,
with the member that is missing and what it must take.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass

from channel.codec.codec import ERASED, Codec, Coder, Model
from channel.codec.signals import signals_of
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from tenbaud.config.load import ConfigError

OPTIONAL = ("uses_rates",)
"""Attributes that a part may leave out; the codec then takes the plainest value."""

HELP = "docs/extend.md has an example of each part."


class PartError(ConfigError):
    """A part that cannot be used; the text names where it was given, its class, and what is wrong."""


@dataclass(frozen=True, slots=True)
class Parts:
    """Objects that replace configured parts; None: as configured."""

    model: Model | None = None
    coder: Coder | None = None
    plant: Plant | None = None
    controller: Controller | None = None
    has_own_set_points: bool = True
    """of a controller: false where it was built for the flight, with the configured ones"""

    def check(self) -> None:
        """Raise PartError for an object that lacks a required attribute of its part."""
        protocols = {"model": Model, "coder": Coder, "plant": Plant, "controller": Controller}
        for name, protocol in protocols.items():
            if (part := getattr(self, name)) is not None:
                check_part(f"the {name}", part, protocol)


def check_part(where: str, part: object, protocol: type) -> None:
    """Raise PartError, naming every fault, unless `part` has what the protocol asks for.

    `where` says how it was given: "the plant", "receiver.controller = 'mine:Law'".
    """
    kind = protocol.__name__.lower()
    if inspect.isclass(part):
        raise PartError(
            f"{where} is the class {part.__name__}; give an object of it, {part.__name__}(...)"
        )
    faults = [*_attribute_faults(part, protocol), *_method_faults(part, protocol)]
    if faults:
        raise PartError(f"{where} ({type(part).__name__}) is no {kind}: {'; '.join(faults)}. {HELP}")


def check_codec(where: str, codec: Codec) -> None:
    """Run a codec through one word and one erasure; PartError where its parts do not fit each other."""
    try:
        signals_of(codec.model)
        command = (0.0,) * codec.model.input_size
        state = codec.initial()
        word = codec.encode(state, codec.predicted(state))
        codec.coder.alphabet.word_number(word)
        for consumed in (word, ERASED):
            before = len(state.model), len(state.coder)
            state = codec.step(state, consumed, [command] * codec.ticks_per_sample)
            if (len(state.model), len(state.coder)) != before:
                raise ValueError("the number of states changed within a sample")
            codec.pack(state)
        codec.coder.ranges(state.coder)[0]
    except Exception as error:  # it is the user's code, and anything may be wrong in it
        raise PartError(f"{where} cannot run one sample: {type(error).__name__}: {error}") from error


def _attribute_faults(part: object, protocol: type) -> list[str]:
    wanted = {name: str(kind) for name, kind in inspect.get_annotations(protocol).items()}
    for name, member in vars(protocol).items():
        if isinstance(member, property) and member.fget is not None:
            wanted[name] = str(inspect.get_annotations(member.fget).get("return", ""))
    return [
        f"it has no attribute {name} ({kind})"
        for name, kind in wanted.items()
        if name not in OPTIONAL and not hasattr(part, name)
    ]


def _method_faults(part: object, protocol: type) -> list[str]:
    methods = {
        name: list(inspect.signature(member).parameters)[1:]
        for name, member in vars(protocol).items()
        if inspect.isfunction(member) and not name.startswith("_")
    }
    return [fault for name, takes in methods.items() if (fault := _method_fault(part, name, takes))]


def _method_fault(part: object, name: str, takes: Sequence[str]) -> str:
    """Return the fault of one method; empty: none."""
    call = f"({', '.join(takes)})"
    if not hasattr(part, name):
        return f"it has no method {name}{call}"
    method = getattr(part, name)
    if not callable(method):
        return f"its {name} is not a method; it must be one that takes {call}"
    try:
        signature = inspect.signature(method)
    except ValueError:  # a builtin whose signature is not known
        return ""
    try:
        signature.bind(*takes)
    except TypeError:
        return f"its method {name} must take {call}, not {_plain(signature)}"
    return ""


def _plain(signature: inspect.Signature) -> inspect.Signature:
    """Return a signature without its annotations."""
    empty = inspect.Signature.empty
    parameters = [one.replace(annotation=empty) for one in signature.parameters.values()]
    return inspect.Signature(parameters)
