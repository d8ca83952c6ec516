"""The settings of a log that are kept beside it: `flight.csv.toml` for `flight.csv`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tenbaud.config.schema import FlightLogSection
from tenbaud.files.whole import write_whole
from tenbaud.log.table import LogError


def with_file_beside(section: FlightLogSection) -> FlightLogSection:
    """Return a section with what the file beside its log says and it does not say itself."""
    path = Path(f"{section.file}.toml")
    if not path.is_file():
        return section
    try:
        given: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
        FlightLogSection.model_validate(given)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise LogError(f"{path}: not TOML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(one) for one in first["loc"])
        raise LogError(
            f"{path}: {field}: {first['msg']}; the fields are those of [flight_log]"
        ) from error
    own = section.model_dump(exclude_unset=True)
    for name, value in own.items():
        given[name] = {**given.get(name, {}), **value} if isinstance(value, dict) else value
    return FlightLogSection.model_validate(given)


def write_beside(section: FlightLogSection) -> None:
    """Write what a section says into the file beside its log."""
    import tomli_w

    values = section.model_dump(mode="json", exclude_defaults=True, exclude={"file"})
    write_whole(Path(f"{section.file}.toml"), tomli_w.dumps(values))
