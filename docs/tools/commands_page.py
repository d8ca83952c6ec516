"""The reference page of the command line, from the commands themselves: what `reference.py` writes."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer
from typer.models import ArgumentInfo, OptionInfo

from tenbaud.cli.commands import app
from tenbaud.flight.outcome import ExitCode

INTRODUCTION = """# Commands

<!-- Written by `make reference` from the command line itself. Change that, not this page. -->

`tenbaud COMMAND --help` says the same in the terminal. Results go to standard output, everything else
to standard error; with `--json` a command writes one JSON object and nothing else. An option that is
*repeatable* may be given several times.

| exit code | meaning |
|---|---|
"""

SKIPPED = (
    "<!-- test: skip, forms of the command from its help, with addresses and files as examples: "
    "their words are checked -->"
)

EXIT_MEANINGS = {
    ExitCode.OK: "success",
    ExitCode.FAILED: "something failed, or a check found a difference",
    ExitCode.USAGE: "the command line or the configuration cannot be used",
    ExitCode.MISMATCH: "the two ends differ in version, configuration or arithmetic",
    ExitCode.LINK_LOST: "the other end did not answer, or was lost",
    ExitCode.DESYNC: "the codecs differed without a requested corruption; or `--on-desync stop`",
    ExitCode.SAFETY_STOP: "the rig or the guard beside the motors ended the flight",
    ExitCode.NOT_FLOWN: "the flight reached its end but [did not fly](../RELIABILITY.md#did-it-fly)",
    ExitCode.NOT_WRITTEN: "a file, the recording or standard output could not be written",
    ExitCode.INTERRUPTED: "Ctrl-C, or another signal to end",
}


def commands_page() -> str:
    """Return the whole page."""
    codes = [f"| {int(code)} | {EXIT_MEANINGS[code]} |" for code in ExitCode]
    parts = [INTRODUCTION + "\n".join(codes) + "\n", *_commands(app, "tenbaud")]
    return "\n".join(parts).rstrip() + "\n"


def _commands(group: typer.Typer, prefix: str) -> Iterator[str]:
    for info in group.registered_commands:
        if info.callback is not None and not info.hidden:
            name = info.name or info.callback.__name__.replace("_", "-")
            yield from _command(f"{prefix} {name}", info.callback)
    for below in group.registered_groups:
        if below.typer_instance is not None:
            yield from _commands(below.typer_instance, f"{prefix} {below.name}")


def _command(name: str, callback: Callable[..., Any]) -> Iterator[str]:
    text, examples = _help(inspect.getdoc(callback) or "")
    yield f"## `{name}`\n"
    yield f"{text}\n"
    if examples:
        yield "For example:\n"
        yield "\n".join([SKIPPED, "```sh", *examples, "```"]) + "\n"
    rows = [row for row in _rows(callback) if row]
    if rows:
        yield "| argument or option | default | meaning |"
        yield "|---|---|---|"
        yield from rows
        yield ""


def _rows(callback: Callable[..., Any]) -> Iterator[str]:
    hints = get_type_hints(callback, include_extras=True)
    for name, parameter in inspect.signature(callback).parameters.items():
        kind, info = _declared(hints[name])
        if info is None or info.hidden:
            continue
        names = (
            _argument(name, parameter) if isinstance(info, ArgumentInfo) else _option(name, info, kind)
        )
        default = parameter.default
        unset = default in (inspect.Parameter.empty, None, False, "") or default is ...
        shown = "" if unset else f"`{default}`"
        meaning = " ".join((info.help or "").split()).replace("|", "\\|").replace("<", "&lt;")
        yield f"| {names} | {shown} | {meaning} |"


def _declared(hint: Any) -> tuple[Any, ArgumentInfo | OptionInfo | None]:
    """Return (type, what typer was told) of a parameter."""
    if get_origin(hint) is not Annotated:
        # Optional[Annotated[...]]: the declaration is one level further in.
        for part in get_args(hint):
            if get_origin(part) is Annotated:
                return _declared(part)
        return hint, None
    kind, *extra = get_args(hint)
    found = [part for part in extra if isinstance(part, ArgumentInfo | OptionInfo)]
    return kind, found[0] if found else None


def _argument(name: str, parameter: inspect.Parameter) -> str:
    required = parameter.default in (inspect.Parameter.empty, ...)
    return f"`{name.upper()}`" if required else f"`[{name.upper()}]`"


def _option(name: str, info: OptionInfo, kind: Any) -> str:
    # In Annotated[...] the first name given stands where a default would.
    declared = [
        one
        for one in (info.default, *(info.param_decls or ()))
        if isinstance(one, str) and one.startswith("-")
    ]
    names = ", ".join(f"`{one}`" for one in declared or ["--" + name.replace("_", "-")])
    several = False
    while get_args(kind) and get_origin(kind) is not Literal:
        several = several or get_origin(kind) is list
        kind = next(part for part in get_args(kind) if part is not NoneType)
    if kind is bool:
        return names
    if get_origin(kind) is Literal:
        shown = "\\|".join(get_args(kind))
    else:
        shown = {str: "TEXT", float: "NUMBER", int: "WHOLE NUMBER"}.get(kind, "PATH")
    return f"{names} {shown}" + (", repeatable" if several else "")


def _help(text: str) -> tuple[str, list[str]]:
    """Split the help into its text and its dimmed examples."""
    examples = re.findall(r"\[dim\](.*?)\[/dim\]", text, re.DOTALL)
    rest = re.sub(r"\[dim\].*?\[/dim\]", "", text, flags=re.DOTALL)
    paragraphs = [" ".join(part.split()) for part in rest.split("\n\n") if part.strip()]
    return "\n\n".join(paragraphs), examples
