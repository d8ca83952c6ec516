"""Stopping on a signal: the first asks the flight to end safely, the second ends it at once."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType
from typing import Self

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class _Handlers:
    """Within a `with`, a handler gets the signals that end a process.

    A SIGHUP that is ignored stays so: the command was started with nohup.
    """

    def __init__(self, handler: Callable[[int, FrameType | None], None]) -> None:
        self._handler = handler
        self._before: dict[int, object] = {}

    def __enter__(self) -> Self:
        for number in SIGNALS:
            if number == SIGNALS[0] or signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, self._handler)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]


class StopFlag(_Handlers):
    """Within a `with`, signals raise this flag instead of ending the process."""

    def __init__(self) -> None:
        super().__init__(self._on_signal)
        self.raised = False

    def __call__(self) -> bool:
        return self.raised

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.raised:
            raise KeyboardInterrupt
        self.raised = True


class Interruptions(_Handlers):
    """Within a `with`, signals raise KeyboardInterrupt: open files and links are closed."""

    def __init__(self) -> None:
        super().__init__(self._on_signal)
        self.received: signal.Signals | None = None

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.received = signal.Signals(number)
        raise KeyboardInterrupt
