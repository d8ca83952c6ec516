"""Errors of a rig before a flight; in flight they are faults in a reading instead."""

from __future__ import annotations

from channel.errors import TenbaudError


class RigError(TenbaudError):
    """A rig that cannot be opened or used; the text says what to do next."""
