"""The error that a person sees when a recording or a run folder cannot be used."""

from __future__ import annotations


class RecordingError(Exception):
    """Says what happened, to which file, and what to do next."""
