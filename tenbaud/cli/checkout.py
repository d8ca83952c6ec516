"""Commands that make the project's own pages work in a checkout only."""

from __future__ import annotations

from importlib.util import find_spec

from tenbaud.config.load import ConfigError


def need_checkout(command: str) -> None:
    """Raise ConfigError where the generators of the project's pages are not installed."""
    if find_spec("reproduction") is None:
        raise ConfigError(
            f"`tenbaud {command}` makes pages of the project's own documentation and works in a "
            "checkout of it only: clone the repository, run `pip install --editable .` in it, and "
            "call the command from there"
        )
