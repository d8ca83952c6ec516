"""Shell completion of preset and field names."""

from __future__ import annotations


def presets(incomplete: str) -> list[str]:
    """Return the presets that begin so."""
    from tenbaud.config.load import preset_names

    return [name for name in preset_names() if name.startswith(incomplete)]


def settings(incomplete: str) -> list[str]:
    """Return the fields that begin so, as `--set` takes them."""
    from tenbaud.config.load import flattened, load_config

    fields = flattened(load_config().model_dump())
    return [f"{name}=" for name, _ in fields if name.startswith(incomplete)]
