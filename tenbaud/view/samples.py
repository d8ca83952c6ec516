"""The samples of a recorded flight as the page's tape shows them, joined from both ends."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from channel.line.meters import BaudMeter
from tenbaud.recording.reader import Recording
from tenbaud.recording.table import Series, Table

RATE_SPAN_S = BaudMeter.SPAN_NS / 1e9
SAMPLE_FIELDS = ("sample", "word_sent", "word", "range", "digest", "peer_digest", "about", "arrival_s")


class RecordedSamples:
    """The sample rows of both ends; either may be missing."""

    def __init__(self, transmitter: Recording | None, receiver: Recording | None) -> None:
        self._up, self._down = _table(transmitter), _table(receiver)
        table = self._up if self._up is not None else self._down
        words = np.zeros((0, 1)) if table is None else table["word"]
        self.symbols_per_word = max(1, words.shape[1])
        self._keys = np.zeros(0, dtype=np.int64) if table is None else table.keys
        self._erased = (
            np.cumsum(np.isnan(words).all(axis=1)) if words.shape[1] else np.zeros(len(words))
        )
        self._compared = np.zeros(0)
        if self._up is not None:
            digests = zip(self._column("digest"), self._peer_digests(), strict=True)
            self._compared = np.cumsum([bool(one and other) for one, other in digests])

    def _column(self, name: str) -> Any:
        table = self._up
        assert table is not None
        return table[name] if name in table.names else [None] * len(table)

    def _peer_digests(self) -> list[Any]:
        """Return the receiver's digests as they came; where none comes down, as it recorded them."""
        came = list(self._column("peer_digest"))
        if any(came) or self._down is None or "digest" not in self._down.names:
            return came
        recorded = dict(zip(self._down.keys.tolist(), self._down["digest"].tolist(), strict=True))
        return [recorded.get(sample) for sample in self._keys.tolist()]

    def _count(self, sums: NDArray[Any], sample: int) -> int:
        row = int(np.searchsorted(self._keys, sample, side="right")) - 1
        return int(sums[row]) if 0 <= row < len(sums) else 0

    def erased_by(self, sample: int) -> int:
        """Return how many words were erased up to a sample."""
        return self._count(self._erased, sample)

    def compared_by(self, sample: int) -> int:
        """Return how many samples up to this one have the digests of both ends."""
        return self._count(self._compared, sample)

    @property
    def compared(self) -> int:
        """Samples of the whole recording that have the digests of both ends."""
        return int(self._compared[-1]) if len(self._compared) else 0

    def rate_at(self, sample: int) -> float | None:
        """Return the symbols per second of the 5 s before a sample, on the receiver's clock."""
        table = self._down
        if table is None or "arrival_s" not in table.names:
            return None
        last = int(np.searchsorted(table.keys, sample, side="right"))
        arrived: Series = table["arrival_s"][:last]
        if last < 2:
            return None
        first = int(np.searchsorted(arrived, arrived[-1] - RATE_SPAN_S - 1e-9))
        came = ~np.isnan(table["word"][first + 1 : last]).all(axis=1)
        span_s = float(arrived[-1] - arrived[first])
        return float(came.sum()) * self.symbols_per_word / span_s if span_s > 0.0 else None

    def last(self, sample: int, most: int) -> list[list[Any]]:
        """Return the last samples up to one, as the board has them."""
        found: dict[int, list[Any]] = {}
        for table, places in (
            (self._up, {"word_sent": 1, "word": 2, "digest": 3, "peer_digest": 4, "about": 5}),
            (self._down, {"word": 2, "digest": 4}),
        ):
            if table is None:
                continue
            end = int(np.searchsorted(table.keys, sample, side="right"))
            rows = slice(max(0, end - most), end)
            numbers = table.keys[rows].tolist()
            for name, place in places.items():
                values = table[name][rows].tolist() if name in table.names else []
                for number, value in zip(numbers, values, strict=False):
                    row = found.setdefault(number, [number, None, None, None, None, None])
                    row[place] = _word(value) if isinstance(value, list) else value
        return [found[number] for number in sorted(found)][-most:]


def _word(values: list[float]) -> list[int] | None:
    known = [int(value) for value in values if value == value]
    return known or None


def _table(recording: Recording | None) -> Table | None:
    return recording.topics.get("sample") if recording is not None else None
