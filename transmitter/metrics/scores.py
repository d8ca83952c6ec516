"""Errors of the receiver's estimate, kept as running figures, never as lists.

Two errors are kept for every tick of the window. *Coded* is the codec's own error at that tick, as in
the paper; *live* is the error of the receiver's predicted estimate when it had to decide the
tick's command, prediction included. Both are against the true output where the rig knows it, else
against the encoder.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from channel.codec.codec import Model, Vector, Word

References = Callable[[int], tuple[float | None, ...]]
"""Set-points of the outputs at a tick; None, or missing at the end, where there is none."""


WORDS_KEPT = 48


class ErrorMeter:
    """Largest and root-mean-square value of a stream of errors."""

    def __init__(self) -> None:
        self.count = 0
        self.largest = 0.0
        self._sum_of_squares = 0.0

    def add(self, error: float) -> None:
        self.count += 1
        size = error if error >= 0.0 else -error
        if size > self.largest:
            self.largest = size
        self._sum_of_squares += error * error

    @property
    def rms(self) -> float | None:
        """Return the root mean square; None without a value."""
        return math.sqrt(self._sum_of_squares / self.count) if self.count else None


class OutputScores:
    """The errors of one output, and how far it went."""

    def __init__(self) -> None:
        self.coded = ErrorMeter()
        self.live = ErrorMeter()
        self.tracking = ErrorMeter()
        self.largest = 0.0
        """of the output itself, either way"""
        self.reference_largest = 0.0
        self.last_coded_error: float | None = None
        self.last: float | None = None
        self.symbols = 0
        """that were about this output, in the whole flight"""


class Scores:
    """Collects the errors of a flight from tick `window_start_tick` on, for each output.

    `span_ticks` bounds how long a reading waits for its estimate; older ones are forgotten.
    `on_live_errors` gets the live errors of every tick in the window, one per output.
    """

    def __init__(
        self,
        model: Model,
        window_start_tick: int,
        span_ticks: int,
        references: References,
        on_live_errors: Callable[[Vector], None] = lambda _: None,
    ) -> None:
        self.window_start_tick = window_start_tick
        self.outputs = tuple([OutputScores() for _ in model.measured(model.initial())])
        self.last_words: deque[tuple[Word, tuple[int, ...] | None]] = deque(maxlen=WORDS_KEPT)
        """the last confirmed words, and the output that each symbol was about"""
        self._model = model
        self._references = references
        self._on_live_errors = on_live_errors
        # An estimate may come before its reading (the echo of a sample's first tick speaks of all its
        # ticks) or long after it; each waits for the other.
        self._readings: deque[tuple[int, Vector]] = deque(maxlen=span_ticks)
        self._estimates: deque[tuple[int, Vector, Vector | None]] = deque(maxlen=span_ticks)

    @property
    def first(self) -> OutputScores:
        return self.outputs[0]

    def forget_reference(self) -> None:
        """Score no more tracking: the set-point is no longer the one that is known here."""
        self._references = lambda _tick: ()

    def on_word(self, word: Word, about: tuple[int, ...] | None) -> None:
        self.last_words.append((word, about))
        for place in about or ():
            self.outputs[place].symbols += 1

    def on_outputs(self, tick: int, values: Vector) -> None:
        """Note the outputs of a tick; ticks come in order."""
        inside = tick >= self.window_start_tick
        references = self._references(tick) if inside else ()
        for place, score in enumerate(self.outputs):
            score.last = value = values[place]
            if not inside:
                continue
            if value > score.largest or -value > score.largest:
                score.largest = abs(value)
            reference = references[place] if place < len(references) else None
            if reference is not None:
                if reference > score.reference_largest or -reference > score.reference_largest:
                    score.reference_largest = abs(reference)
                score.tracking.add(reference - value)
        self._readings.append((tick, values))
        self._join()

    def on_estimate(self, tick: int, coded: Vector, live: Vector | None) -> None:
        """Take the estimate of a tick; ticks come in order."""
        measured = self._model.measured
        self._estimates.append((tick, measured(coded), None if live is None else measured(live)))
        self._join()

    def _join(self) -> None:
        """Score every tick of which both sides are known; forget those that one side skipped."""
        readings, estimates = self._readings, self._estimates
        while readings and estimates:
            if readings[0][0] < estimates[0][0]:
                readings.popleft()
            elif estimates[0][0] < readings[0][0]:
                estimates.popleft()
            else:
                self._score(readings.popleft()[1], *estimates.popleft())

    def _score(self, values: Vector, tick: int, coded: Vector, live: Vector | None) -> None:
        inside = tick >= self.window_start_tick
        for place, score in enumerate(self.outputs):
            score.last_coded_error = error = values[place] - coded[place]
            if inside:
                score.coded.add(error)
                if live is not None:
                    score.live.add(values[place] - live[place])
        if inside and live is not None:
            self._on_live_errors(tuple([one - other for one, other in zip(values, live, strict=True)]))
