"""Errors of the identification when the data do not allow an estimate."""

from __future__ import annotations


class IdentificationError(ValueError):
    """Data or settings that no estimate can come from; the text names the cause and what to do."""
