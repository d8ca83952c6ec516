"""Bounds for the fields of a frame. A frame out of bounds is dropped before any of it is kept.

A good check says that a frame arrived as it was sent, not that it makes sense: the sender may have
failed, may be of another flight, or may be somebody else. So both sessions ask here, for every frame
that they would act on, and count what is dropped under `COUNTER`. The limits:

* **counters**: samples and slots leave half of their range on the wire for the flight that follows, and
  flight times fit 63 bits of nanoseconds;
* **reach**: a sample is at most twice the history (`Terms.history_samples`) ahead of what this end's
  own clock says; `receiver.session.schedule` is stricter with symbols and requests;
* **states**: of this codec and finite, the model within `STATE_MAX`, the coder as its kind says;
* **commands**: as many as a sample has, each within the limit of its input, as the receiver's limiter
  leaves them;
* **lists and texts**: no more echoes than a command frame repeats; texts cut and without control
  characters, because they are shown on terminals and sent on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from channel.codec.codec import WIRE_ERASED, Codec, Vector, is_coder_state, is_estimate
from channel.codec.downlink.machine import TwoWay
from channel.protocol.events import Dropped, Event, EventKind, Tell
from channel.protocol.frames import (
    Bye,
    Commands,
    Desync,
    DownSymbol,
    Echo,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Welcome,
)
from channel.protocol.limits import to_steps
from channel.protocol.terms import Terms

COUNTER = "out_of_bounds"
"""Name of the count of frames that sessions drop for their contents; summaries show it."""

COUNTER_MAX = 3 * 2**30
"""Three quarters of what 32 bits count: slots beyond are left to the flight that goes on."""
TIME_NS_MAX = 3 * 2**61
FIRST_SHARE = 2.0 / 3.0
"""How far into these a first flight may begin, so that what is asked for later is within them."""

TEXT_CHARACTERS_MAX = 2000
"""Four bytes each at most, so that a text that is quoted in an answer still fits a frame."""


class Bounds:
    """The bounds of one flight. The methods `of_...` return what is wrong with a frame; None: nothing.

    What is dropped is counted in `counts` and reported to `emit`.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        counts: Counter[str],
        emit: Tell,
        two_way: TwoWay | None = None,
    ) -> None:
        self._counts = counts
        self._emit = emit
        self._codec = codec
        self._terms = terms
        self._two_way = two_way
        self._echoes_max = terms.repeats + 1
        # The two counts of samples may differ by the history, by which either end runs on when it hears
        # nothing, and by the round trip, which the history covers as well.
        self._reach = 2 * terms.history_samples
        self._inputs = codec.model.input_size
        self._values = terms.ticks_per_sample * self._inputs
        pairs = zip(terms.limits.command_max, terms.initial_command, strict=True)
        largest = [max(limit, abs(first)) for limit, first in pairs]
        self._largest = largest
        self._steps_max = to_steps(largest, terms.signals)
        self._state_bytes = len(codec.pack(codec.initial()))
        self.sample_max = min(COUNTER_MAX // terms.symbols_per_word, TIME_NS_MAX // terms.sample_ns)

    def drops(self, problem: str | None) -> bool:
        """Count and report a frame that is dropped for its contents; return whether it is."""
        if problem is None:
            return False
        self._counts[COUNTER] += 1
        self._emit(Event(EventKind.STALE, cause=Dropped.OUT_OF_BOUNDS, detail=problem))
        return True

    def of_symbol(self, symbol: Symbol) -> str | None:
        """Check a symbol of the present epoch, but for its time."""
        if self._codec.coder.alphabet.symbol(symbol.number) is None:
            return f"symbol number {symbol.number} is not in the alphabet"
        return self._of_sample(symbol.slot // self._terms.symbols_per_word)

    def of_down_symbol(self, symbol: DownSymbol, sample: int) -> str | None:
        """Check a down symbol of the present epoch, but for its time; the clock stands in `sample`."""
        if symbol.number not in (0, 1):
            return f"down symbol number {symbol.number} is neither 0 nor 1"
        of_sample = symbol.slot // self._terms.down_symbols
        if of_sample > sample + self._reach:
            return f"a down symbol of sample {of_sample} during sample {sample}"
        return self._of_sample(of_sample)

    def of_hello(self, hello: Hello) -> str | None:
        """Check a request for a session, but for its time."""
        return self._of_sample(hello.sample)

    def of_report(self, report: Desync, epoch: int, sample: int) -> str | None:
        """Check the report of a difference at an end that consumes `sample` next."""
        if report.epoch > epoch or not sample - self._reach <= report.sample < sample:
            return f"a difference after sample {report.sample} of epoch {report.epoch}"
        if report.state and len(report.state) != self._state_bytes:
            return f"a state of {len(report.state)} bytes"
        return None

    def of_commands(
        self, commands: Commands, sample: int, confirmed: int, next_sample: int
    ) -> str | None:
        """Check a command frame, but for the echoes that were had before.

        The clock stands in `sample`; `confirmed` is to be confirmed next, `next_sample` to be sent.
        """
        if len(commands.echoes) > self._echoes_max:
            return f"{len(commands.echoes)} echoes, where at most {self._echoes_max} are agreed"
        if commands.echoes[-1].sample > sample + self._reach:
            return f"an echo of sample {commands.echoes[-1].sample} during sample {sample}"
        for echo in commands.echoes:
            if echo.sample < confirmed:
                continue
            problem = self._of_echo(echo)
            if problem is not None:
                return problem
            # A held-up transmitter may hear of an erasure before it notices that it sent nothing;
            # a word for a sample that has not been sent is nobody's.
            if echo.sample >= next_sample and echo.word_number != WIRE_ERASED:
                return f"a word for sample {echo.sample}, which has not been sent"
        return None

    def of_welcome(self, welcome: Welcome, sample: int | None) -> str | None:
        """Check an answer; `sample` is where the clock stands, None before this end's first flight."""
        if welcome.session == 0:
            return "a session without a number"
        hold = welcome.hold_steps
        if hold and len(hold) != self._inputs:
            return f"a command to hold for {len(hold)} inputs, not {self._inputs}"
        if hold and not self._are_allowed(hold):
            return f"a command of {hold} steps to hold, beyond +-{self._steps_max}"
        if sample is not None and welcome.first_sample > sample + self._reach + self._lead_samples:
            return f"a start at sample {welcome.first_sample} during sample {sample}"
        if sample is None and welcome.first_sample > FIRST_SHARE * self.sample_max:
            return f"a first start at sample {welcome.first_sample}"
        return self._of_sample(welcome.first_sample) or self._of_state(welcome)

    @property
    def _lead_samples(self) -> int:
        return -(-self._terms.lead_ticks // self._terms.ticks_per_sample)

    def _of_sample(self, sample: int) -> str | None:
        if sample > self.sample_max:
            return f"sample {sample}, beyond {self.sample_max}"
        return None

    def _of_echo(self, echo: Echo) -> str | None:
        if len(echo.steps) != self._values:
            return f"{len(echo.steps)} values for a sample, not {self._values}"
        if not self._are_allowed(echo.steps):
            return f"a command beyond +-{self._steps_max} steps for sample {echo.sample}"
        if not self._codec.coder.alphabet.has_word(echo.word_number):
            return f"word number {echo.word_number} is no word"
        return None

    def _are_allowed(self, steps: Sequence[int]) -> bool:
        for index, largest in enumerate(self._steps_max):
            # min and max: this runs for every command frame, and they are the fastest there is.
            values = steps[index :: self._inputs]
            if values and not (-largest <= min(values) and max(values) <= largest):
                return False
        return True

    def _of_state(self, welcome: Welcome) -> str | None:
        if not welcome.state:
            return None
        commands: tuple[Vector, ...] = ()
        try:
            if self._two_way is None:
                state = self._codec.unpack(welcome.state)
            else:
                whole = self._two_way.unpack(welcome.state)
                state, commands = whole.codec, (*whole.commands, whole.hold)
        except ValueError as error:
            return str(error)
        for command in commands:
            if not all(-most <= one <= most for one, most in zip(command, self._largest, strict=True)):
                return f"a state with the command {command}, beyond +-{self._largest}"
        if state.sample != welcome.first_sample:
            return f"a state of sample {state.sample} for sample {welcome.first_sample}"
        if not (is_estimate(state.model) and is_coder_state(self._codec.coder, state.coder)):
            return f"not a state of this codec: {state}"
        return None


def within_text_bounds(frame: Frame) -> Frame:
    """Return the frame with its texts as they may be shown and sent on."""
    match frame:
        case Bye():
            return replace(frame, text=shown(frame.text))
        case Refuse():
            return replace(frame, text=shown(frame.text))
    return frame


def shown(text: str, characters_max: int = TEXT_CHARACTERS_MAX) -> str:
    """Return a peer's text, truncated, with question marks for terminal control characters."""
    cut = text if len(text) <= characters_max else text[: characters_max - 3] + "..."
    return "".join([one if one.isprintable() or one == "\n" else "?" for one in cut])
