"""The settings of a log that are kept beside it: `flight.csv.toml` for `flight.csv`."""

from __future__ import annotations

from pathlib import Path

from tenbaud.config.deprecated import with_current_names
from tenbaud.config.load import ConfigError, checked, read_toml, toml_text
from tenbaud.config.schema import FlightLogSection
from tenbaud.files.whole import write_whole
from tenbaud.log.table import LogError


def with_file_beside(section: FlightLogSection) -> FlightLogSection:
    """Return a section, completed from the file beside its log."""
    path = Path(f"{section.file}.toml")
    if not path.is_file():
        return section
    try:
        given = with_current_names({"flight_log": read_toml(path)}, str(path))["flight_log"]
        checked({"flight_log": given}, path)
    except ConfigError as error:
        raise LogError(str(error)) from error
    own = section.model_dump(exclude_unset=True)
    for name, value in own.items():
        given[name] = {**given.get(name, {}), **value} if isinstance(value, dict) else value
    return FlightLogSection.model_validate(given)


def write_beside(section: FlightLogSection) -> None:
    """Write a section into the file beside its log."""
    values = section.model_dump(mode="json", exclude_defaults=True, exclude={"file"})
    write_whole(Path(f"{section.file}.toml"), toml_text(values))
