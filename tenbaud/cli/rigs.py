"""How `--rig` names a rig."""

from __future__ import annotations

from pathlib import Path

import typer


def settings_of(rig: str) -> dict[str, object]:
    """Return the fields that `--rig KIND` or `--rig KIND:WHERE` sets."""
    kind, _, where = rig.partition(":")
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
                "transmitter.quarc.host": host.strip("[]") or "127.0.0.1",
                "transmitter.quarc.port": int(port),
            }
        case "cobs" | "ascii" | "qsb":
            if not where:
                raise typer.BadParameter(f"write --rig {kind}:PORT, such as {kind}:/dev/ttyACM0")
            return {
                "transmitter.rig": "serial",
                "transmitter.serial.format": kind,
                "transmitter.serial.port": where,
            }
        case "replay":
            if not where:
                raise typer.BadParameter("write --rig replay:FILE, with the recorded flight's file")
            return {
                "transmitter.rig": "replay",
                "receiver.controller": "recorded",
                "flight_log.file": str(Path(where).resolve()),
            }
        case "simulated" | "serial":
            # A serial rig may have its port from the configuration's own file.
            return {"transmitter.rig": kind}
        case _:
            raise typer.BadParameter(f"--rig {rig}: no such rig; there are {FORMS}")


FORMS = (
    "simulated, replay:FILE for a recorded flight, or a real rig: cobs:PORT, ascii:PORT, qsb:PORT, "
    "quarc:HOST:PORT, quarc-server:PORT, hil[:CARD]."
)
