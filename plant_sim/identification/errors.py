"""Errors of the identification when the data do not allow an estimate."""

from __future__ import annotations


class IdentificationError(ValueError):
    """Data or settings that allow no estimate; the text gives the cause and the remedy."""
