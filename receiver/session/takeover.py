"""A receiver without a flight that hears symbols of an unknown session.

It was restarted during its flight, or it is a second one. It cannot know which, so it answers that it
does not know the session, and the transmitter decides. With `--take-over` it claims the flight.
"""

from __future__ import annotations

from channel.protocol.frames import Claim, Frame, Symbol, Unknown


class Takeover:
    """Answers the symbols of an unknown session."""

    def __init__(self, session_number: int, take_over: bool) -> None:
        self._session_number = session_number
        self._take_over = take_over
        self.asked = False
        """whether a transmitter was asked for its flight, so that its refusal is meant for us"""

    def on_symbol(self, symbol: Symbol) -> list[Frame]:
        """Return the answer to the transmitter of a symbol."""
        self.asked = True
        if self._take_over:
            return [Claim(symbol.session, symbol.epoch, self._session_number)]
        return [Unknown(symbol.session, symbol.epoch)]
