"""How `--rig` names a real rig."""

from __future__ import annotations

import typer

KINDS = ("cobs", "ascii", "qsb", "quarc", "quarc-server", "hil")


def settings_of(kind: str, where: str) -> dict[str, object]:
    """Return the fields that `--rig KIND:WHERE` sets."""
    match kind:
        case "hil":
            settings: dict[str, object] = {"transmitter.rig": "hil"}
            return settings | ({"transmitter.hil.card_type": where} if where else {})
        case "quarc" | "quarc-server":
            host, _, port = where.rpartition(":")
            if not port.isdigit():
                form = "quarc:HOST:PORT" if kind == "quarc" else "quarc-server:[HOST:]PORT"
                raise typer.BadParameter(f"write --rig {form}")
            return {
                "transmitter.rig": "quarc",
                "transmitter.quarc.role": "client" if kind == "quarc" else "server",
                "transmitter.quarc.host": host or "127.0.0.1",
                "transmitter.quarc.port": int(port),
            }
        case _:
            if not where:
                raise typer.BadParameter(f"write --rig {kind}:PORT, such as {kind}:/dev/ttyACM0")
            return {
                "transmitter.rig": "serial",
                "transmitter.serial.format": kind,
                "transmitter.serial.port": where,
            }
