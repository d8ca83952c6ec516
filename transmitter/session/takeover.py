"""How a transmitter treats another receiver that requests its flight.

A receiver that hears symbols of an unknown session answers `Unknown`. It is this flight's receiver
after a restart, or a second one. A restarted receiver has lost the session and sends no commands; while
commands arrive, another receiver is a second one and is refused. A deliberate takeover needs a `Claim`
with the new receiver's session: the transmitter ignores all other answers until the new receiver has
answered, refused or let the time pass.
"""

from __future__ import annotations

from channel.protocol.terms import Terms

SILENT_SAMPLES = 2
"""After this time without a command, an `Unknown` means that the receiver has lost the session."""
ALIVE_COMMANDS = 3
"""This many commands since another receiver asked prove that the present one still flies."""
SUCCESSOR_SAMPLES = 3
"""How long a receiver that takes over has for its answer, beside the command lead, which is as long as
a round trip: short enough that the present one can continue before the watchdog trips."""


class Takeover:
    """Judges receivers that are not the present one; times are ticks."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._asked = False
        self._commands_since = 0
        self._successor: int | None = None
        self._until_tick = 0

    def on_command(self) -> None:
        """Note that the present receiver has sent something new."""
        self._commands_since += 1

    def is_lost(self, tick: int, heard_tick: int) -> bool:
        """Return whether the present receiver has been silent for long enough to have lost us."""
        return tick - heard_tick >= SILENT_SAMPLES * self._terms.ticks_per_sample

    def is_second(self) -> bool:
        """Note an `Unknown` for our session; return whether a second receiver sent it."""
        if not self._asked:
            self._asked, self._commands_since = True, 0
            return False
        if self._commands_since < ALIVE_COMMANDS:
            return False
        self._asked = False
        return True

    def name_successor(self, session: int, tick: int) -> None:
        """From now on only this session's answer counts, for a while."""
        self._successor = session
        patience = SUCCESSOR_SAMPLES * self._terms.ticks_per_sample + self._terms.lead_ticks
        self._until_tick = tick + patience

    def successor(self, tick: int) -> int | None:
        """Return the session that is taking over, if one is."""
        if self._successor is not None and tick >= self._until_tick:
            self._successor = None
        return self._successor

    def settle(self) -> None:
        """Forget who asked: a session begins, or the one that was to take over does not."""
        self._successor = None
        self._asked = False
