"""The error of recordings and run folders."""

from __future__ import annotations

from channel.errors import TenbaudError


class RecordingError(TenbaudError):
    """A recording or a run folder cannot be made, read or compared; the text gives the remedy."""
