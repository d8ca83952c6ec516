"""The columns of an exported flight; `tenbaud.recording.signals` names them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from channel.codec.signals import unit_suffix
from tenbaud.log.units import stem_of


def export_roles(names: Sequence[str], units: Sequence[str]) -> Mapping[str, str]:
    """Return the columns of outputs as measured and of inputs as applied; {} for another file.

    Keys are `time`, `out:NAME` and `in:NAME`. A unit is the end of a column's name in some forms.
    """
    plain = [
        name.removesuffix(f"_{unit_suffix(unit)}") if unit else name
        for name, unit in zip(names, units, strict=True)
    ]
    if not any(one.startswith("error_coded") for one in plain) or stem_of(names[0]) not in (
        "tick",
        "time",
    ):
        return {}
    roles = {"time": names[1] if names[0] == "tick" else names[0]}
    for at, name in enumerate(plain):
        if name == "measured":  # of the only output, which is beside it
            roles[f"out:{plain[at - 1]}"] = names[at]
        elif name.removeprefix("measured_") in plain and name.startswith("measured_"):
            roles[f"out:{name.removeprefix('measured_')}"] = names[at]
        elif f"{name}_command" in plain:
            roles[f"in:{name}"] = names[at]
    return roles
