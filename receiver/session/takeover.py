"""A receiver that hears a flight which is not its own, and has none.

It was started again in the middle of its flight, or it is a second one. It cannot know which, so it
says that it does not know the session, and the transmitter decides; or it claims the flight, if it
was told to take over.
"""

from __future__ import annotations

from channel.protocol.frames import Claim, Frame, Symbol, Unknown


class Takeover:
    """Answers the symbols of a foreign session."""

    def __init__(self, session_number: int, take_over: bool) -> None:
        self._session_number = session_number
        self._take_over = take_over
        self.asked = False
        """whether a transmitter was asked for its flight, so that its refusal is meant for us"""

    def on_symbol(self, symbol: Symbol) -> list[Frame]:
        """Return what to say to the transmitter of a symbol."""
        self.asked = True
        if self._take_over:
            return [Claim(symbol.session, symbol.epoch, self._session_number)]
        return [Unknown(symbol.session, symbol.epoch)]
