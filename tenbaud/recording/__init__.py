"""Recordings of a flight: written beside it, read back, compared, described and drawn."""
