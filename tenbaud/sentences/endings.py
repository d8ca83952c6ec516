"""Sentences for how a flight ended, and for the phase of a session."""

from __future__ import annotations

from collections.abc import Mapping

from channel.links.base import Role
from channel.protocol.endings import End, Ending
from channel.protocol.frames import Desync

_ENDINGS: Mapping[Ending, str] = {
    Ending.OVER: "the flight is over",
    Ending.STOPPED: "stopped by the user",
    Ending.FAILED: "its process failed",
    Ending.LINK_LOST: "no messages came from the other end",
    Ending.DESYNC: "the two copies of the codec differ",
    Ending.SAFETY_STOP: "the guard set the motors to their safe voltage",
    Ending.WIRE_VERSION: "the two ends have different wire versions",
    Ending.MISMATCH: "the two ends have different set-ups",
    Ending.BUSY: "this receiver flies with another transmitter",
    Ending.FULL: "this receiver serves its largest number of rigs",
    Ending.CANNOT_SERVE: "this receiver cannot serve this session",
    Ending.ALREADY_ENDED: "the session of this receiver has ended",
    Ending.SECOND_RECEIVER: (
        "the transmitter flies with another receiver; to take the flight over: "
        "tenbaud receive --take-over"
    ),
    Ending.TAKEN_OVER: "another receiver has taken the flight over",
    Ending.REJOINS: "the session has used all 65535 epochs: check the line",
}

_PHASES = {
    "greeting": "waiting for a receiver",
    "waiting": "waiting for a transmitter",
    "rejoining": "requesting a common state",
}


def ending_text(ending: Ending) -> str:
    """Return what an ending means."""
    known = _ENDINGS.get(ending)
    return known or f"for a reason unknown to this version (number {int(ending)})"


def end_text(end: End | None, peer: Role) -> str:
    """Return how a session ended; `peer` is the role of the other end."""
    if end is None:
        return "the session was cut off"
    said = end.text or ending_text(end.ending)
    if not end.by_peer or end.ending is Ending.SECOND_RECEIVER:
        return said
    return f"the {peer} ended the flight: {said}"


def refusal_text(refusal: End) -> str:
    """Return why a flight is refused, as reported by both ends."""
    said = refusal.text or ending_text(refusal.ending)
    return f"{said}\n  reported by the transmitter: {refusal.answer}" if refusal.answer else said


def desync_text(desync: Desync) -> str:
    """Return a sentence about the difference of the two copies."""
    return difference_text(
        desync.sample, f"{desync.transmitter_digest:016x}", f"{desync.receiver_digest:016x}"
    )


def difference_text(sample: object, transmitter_digest: object, receiver_digest: object) -> str:
    """Return where the two copies differ, from the fields of an event."""
    return (
        f"the codecs differ after sample {sample}: transmitter {transmitter_digest}, "
        f"receiver {receiver_digest}"
    )


def phase_text(phase: str) -> str:
    """Return the phase of a session."""
    return _PHASES.get(phase, phase)
