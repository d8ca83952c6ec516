"""Replay of a recorded flight from its symbols."""
