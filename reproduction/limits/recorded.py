"""The recorded flights: second half of the UIUC recording, and the two from NTNU, by preset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from reproduction.paper.flights import Flown, Job, fly
from reproduction.paper.real import HALF_S, NTNU_FILES, UIUC_FILE, convert_ntnu, replayed

UIUC_PRESETS = (
    ("10 bit/s", "uiuc-10baud", "uiuc-history-10baud"),
    ("25 bit/s", "uiuc-25baud", "uiuc-history-25baud"),
)
NTNU_PRESETS = (
    ("10 bit/s", "tuned-10baud", "history-10baud"),
    ("20 bit/s", "tuned-20baud", "history-20baud"),
)


@dataclass(frozen=True, slots=True)
class Row:
    """A recording at a rate: paper-type coder and history coder, tuned alike."""

    recording: str
    rate: str
    paper_type: Flown
    history: Flown

    @property
    def gain(self) -> float:
        """Return by what fraction the rms error is smaller."""
        return 1.0 - self.history.rms / self.paper_type.rms


def fly_recorded(data: Path) -> list[Row]:
    """Fly every recording that is there."""
    rows = []
    if (data / UIUC_FILE).is_file():
        file = (data / UIUC_FILE).resolve()
        for rate, old, new in UIUC_PRESETS:
            pair = [
                fly(Job(preset, preset, replayed(file), window_start_s=HALF_S), Path())
                for preset in (old, new)
            ]
            rows.append(Row("UIUC, hand pushes, second half", rate, *pair))
    with TemporaryDirectory() as folder:
        for name in NTNU_FILES:
            if not (data / name).is_file():
                continue
            log = Path(folder) / f"{name}.csv"
            seconds = convert_ntnu(data / name, log)
            for rate, old, new in NTNU_PRESETS:
                overrides = replayed(log.resolve(), duration_s=seconds)
                pair = [
                    fly(Job(preset, preset, overrides, window_start_s=0.0), Path())
                    for preset in (old, new)
                ]
                rows.append(Row(name.removesuffix(".csv").replace("_", " "), rate, *pair))
    return rows
