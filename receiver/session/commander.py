"""From words to commands: the receiver's copy of the codec, its controller, and the echoes.

The session decides which word was received; this module applies it. Each word advances the codec by
one sample, the controller is asked for the commands of the sample's ticks `D` ahead, and what was
consumed and decided becomes an echo. It knows no slot, no frame and no peer.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sized
from typing import NamedTuple

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.lead import FlownSample, fly_sample
from channel.errors import CodecDiverged
from channel.protocol.compact import CompactForm
from channel.protocol.events import Event, EventKind, Failing, Tell
from channel.protocol.frames import Echo
from channel.protocol.limits import are_plausible, from_steps, to_steps
from channel.protocol.lockstep import History
from channel.protocol.recording import Recorder
from channel.protocol.terms import Terms
from receiver.controllers.base import Controller
from receiver.session.records import write_commands, write_sample
from receiver.session.rejoin import carried_to

Begins = Callable[[int, Vector], None]
"""Is called where the flight begins afresh, with the tick and the outputs estimated there."""
UNWRITTEN_MAX = 32
"""Samples that may be flown before they are recorded even if nobody finds the time."""


class Standing(NamedTuple):
    """The state of a flight that determines the next epoch."""

    state: CodecState
    hold: Vector
    commands: tuple[Vector, ...]


class _Flown(NamedTuple):
    before: CodecState
    word: Word
    flown: FlownSample
    digest: int
    now_ns: int


class Commander:
    """Flies samples; see the module's text.

    `counts` gets `bad_commands` and `bad_references`, and `emit` gets an event for the first of each.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        controller: Controller,
        recorder: Recorder,
        counts: Counter[str],
        emit: Tell,
        begins: Begins | None = None,
    ) -> None:
        self._begins = begins
        self.codec = codec
        self.terms = terms
        self.state = codec.initial()
        self.history = History(codec, 2 * terms.history_samples)
        self.hold = terms.initial_command
        """last command decided"""
        self._controller = controller
        self._no_references: tuple[float | None, ...] = (None,) * len(terms.signals.outputs)
        self._recorder = recorder
        self._counts = counts
        self._emit = emit
        self._commands: deque[Vector] = deque([self.hold] * terms.lead_ticks)
        """of the next `D` ticks"""
        self._echoes: deque[Echo] = deque(maxlen=terms.repeats + 1)
        self._steps: list[int] = []
        """decided for the sample that is being flown"""
        self._compact = CompactForm(codec, terms) if terms.downlink == "compact" else None
        self._unwritten: list[_Flown] = []
        self.first_problem = ""
        """of the controller's commands"""

    @property
    def standing(self) -> Standing:
        """Return where the flight stands, to be gone back to."""
        return Standing(self.state, self.hold, tuple(self._commands))

    def go_back(self, standing: Standing) -> None:
        """Stand where the flight stood before."""
        self.state, self.hold, commands = standing
        self._commands = deque(commands)
        self._echoes.clear()

    def restart(self, sample: int) -> None:
        """Begin afresh at a sample, from the codec's initial state and command."""
        self.write_down()
        self.state = self.codec.initial()._replace(sample=sample)
        self._hold(self.terms.initial_command)
        if self._begins is not None:
            outputs = self.codec.model.measured(self.state.model)
            self._begins(sample * self.terms.ticks_per_sample, outputs)

    def carry_on(self, sample: int, silent_samples: int) -> None:
        """Begin an epoch at a later sample, the state carried there under the last command.

        `silent_samples` had no symbol before.
        """
        known = tuple(self._commands)
        self.state = carried_to(
            self.codec, self.state, sample, known, self.hold, silent_samples, self.terms.history_samples
        )
        self._hold(self.hold)

    def _hold(self, command: Vector) -> None:
        self.hold = command
        self._commands = deque([command] * self.terms.lead_ticks)
        self._echoes.clear()

    def fly(self, word: Word, epoch: int, now_ns: int) -> tuple[Echo, ...]:
        """Consume the word of the next sample; return its echo after those that it repeats."""
        before = self.state
        self._steps = []
        try:
            flown = self._flown(word)
        except (ArithmeticError, ValueError) as error:
            raise CodecDiverged(f"the estimate diverged in sample {before.sample}: {error}") from error
        self._commands.extend(flown.commands)
        for _ in range(len(self._commands) - self.terms.lead_ticks):
            self._commands.popleft()
        self.state = flown.state
        self.history.add(epoch, word, self.state)
        digest = self.codec.digest(self.state)
        number = self.codec.coder.alphabet.word_number(word)
        self._echoes.append(Echo(before.sample, number, digest, tuple(self._steps)))
        self._unwritten.append(_Flown(before, word, flown, digest, now_ns))
        if len(self._unwritten) >= UNWRITTEN_MAX:
            self.write_down()
        return tuple(self._echoes)

    def _flown(self, word: Word) -> FlownSample:
        """Fly a sample with the commands that the controller decides, or with their mean held."""
        known, held = tuple(self._commands), self.hold
        flown = fly_sample(self.codec, self.state, word, known, self._decide)
        if self._compact is None:
            return flown
        # The law's first command, held, would steer half a sample late. The mean moves the plant as the
        # law's own course would, and the law is asked at every tick as ever.
        steps = self._compact.held(flown.commands, held)
        self.hold = from_steps(steps, self.terms.signals)
        self._steps = [*steps] * self.terms.ticks_per_sample
        return fly_sample(self.codec, self.state, word, known, lambda _tick, _state: self.hold)

    def write_down(self) -> None:
        """Record the samples since the last call. It can wait until the commands were sent."""
        unwritten, self._unwritten = self._unwritten, []
        for before, word, flown, digest, now_ns in unwritten:
            ranges = self.codec.coder.ranges(before.coder)
            write_sample(self._recorder, self.terms, word, ranges, flown.state, digest, now_ns)
            write_commands(self._recorder, self.terms, before.sample, flown, self._references)

    def _decide(self, tick: int, state: Vector) -> Vector:
        """Ask the controller, limit its command, and return it as sent on the wire."""
        limited = self.terms.limits.apply(self._ask(tick, state), self.hold)
        steps = to_steps(limited, self.terms.signals)
        self._steps += steps
        self.hold = from_steps(steps, self.terms.signals)
        return self.hold

    def _references(self, tick: int) -> tuple[float | None, ...]:
        try:
            references = self._controller.references(tick)
            if len(references) == len(self._no_references):
                return references
            if len(references) < len(self._no_references):
                return (*references, *self._no_references[len(references) :])
            problem = f"{len(references)} set-points for {len(self._no_references)} output(s)"
        except Exception as error:  # the user's code too, and only a column of the recording
            problem = f"{type(error).__name__}: {error}"
        self._counts["bad_references"] += 1
        if self._counts["bad_references"] == 1:
            self._emit(Event(EventKind.CONTROLLER, tick=tick, cause=Failing.REFERENCE, detail=problem))
        return self._no_references

    def _ask(self, tick: int, state: Vector) -> Vector:
        """Return the controller's command; its last one if it fails or is not finite."""
        try:
            command = self._controller.command(tick, state)
            if isinstance(command, Sized):
                if len(command) == len(self.hold) and are_plausible(command):
                    return command
                problem = f"wants {command}"
            else:
                problem = f"wants {command!r}, and not a tuple of {len(self.hold)} number(s)"
        except Exception as error:  # a controller is the user's code; the flight goes on without it
            problem = f"failed: {type(error).__name__}: {error}"
        self._counts["bad_commands"] += 1
        if self._counts["bad_commands"] == 1:
            self.first_problem = problem
            self._emit(Event(EventKind.CONTROLLER, tick=tick, cause=Failing.COMMAND, detail=problem))
        return self.hold
