"""The commander of the full and the compact downlink: exact commands, and an echo of each word.

Each word advances the codec by one sample, the controller is asked for the commands of the sample's
ticks `D` ahead, and what was consumed and decided becomes an echo.
"""

from __future__ import annotations

from collections import deque

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.lead import FlownSample, fly_sample
from channel.protocol.compact import compact_form
from channel.protocol.frames import Commands, Echo
from channel.protocol.limits import from_steps, to_steps
from channel.protocol.recording import Recorder, write_epoch
from channel.protocol.terms import Terms
from receiver.session.asking import Asker
from receiver.session.commander import Begins, Commander, EchoStanding, Flown, Standing, Start
from receiver.session.rejoin import carried_to


class EchoCommander(Commander):
    """Sends exact commands; see the module's text."""

    def __init__(
        self, codec: Codec, terms: Terms, asker: Asker, recorder: Recorder, begins: Begins | None
    ) -> None:
        super().__init__(codec, terms, asker, recorder, begins)
        self._state = codec.initial()
        self.hold = terms.initial_command
        """last command decided"""
        self._commands: deque[Vector] = deque([self.hold] * terms.lead_ticks)
        """of the next `D` ticks"""
        self._echoes: deque[Echo] = deque(maxlen=terms.repeats + 1)
        self._steps: list[int] = []
        """decided for the sample that is being flown"""
        self.compact = compact_form(codec, terms)

    @property
    def state(self) -> CodecState:
        return self._state

    @property
    def standing(self) -> Standing:
        return EchoStanding(self._state, self.hold, tuple(self._commands))

    def go_back(self, standing: Standing) -> None:
        assert isinstance(standing, EchoStanding)
        self._state, self.hold, commands = standing
        self._commands = deque(commands)
        self._echoes.clear()

    def carry_on(self, sample: int, silent_samples: int) -> None:
        known, lag_max = tuple(self._commands), self.terms.history_samples
        self._state = carried_to(
            self.codec, self._state, sample, known, self.hold, silent_samples, lag_max
        )
        self._hold(self.hold)

    def _begin_afresh(self, sample: int) -> None:
        self._state = self.codec.initial()._replace(sample=sample)
        self._hold(self.terms.initial_command)

    def _start(self, epoch: int) -> Start:
        write_epoch(self._recorder, self.terms.sample_ns, epoch, self._state, self.hold)
        first = self.hold == self.terms.initial_command
        steps = () if first else to_steps(self.hold, self.terms.signals)
        return Start(steps, self.codec.pack(self._state))

    def _hold(self, command: Vector) -> None:
        self.hold = command
        self._commands = deque([command] * self.terms.lead_ticks)
        self._echoes.clear()

    def _fly(self, word: Word, session: int, epoch: int) -> Flown:
        sample = self._state.sample
        self._steps = []
        flown = self._flown(word)
        self._commands.extend(flown.commands)
        for _ in range(len(self._commands) - self.terms.lead_ticks):
            self._commands.popleft()
        self._state = flown.state
        digest = self.codec.digest(flown.state)
        number = self.codec.coder.alphabet.word_number(word)
        self._echoes.append(Echo(sample, number, digest, tuple(self._steps)))
        echoes = tuple(self._echoes)
        if self.compact is not None:
            return Flown(flown, [self.compact.packed(session, epoch, echoes)], lambda: digest)
        return Flown(flown, [Commands(session, epoch, echoes)], lambda: digest)

    def _flown(self, word: Word) -> FlownSample:
        """Fly a sample with the commands that the controller decides, or with their mean held."""
        known, held = tuple(self._commands), self.hold
        flown = fly_sample(self.codec, self._state, word, known, self._decide)
        if self.compact is None:
            return flown
        # The law's first command, held, would steer half a sample late. The mean moves the plant as the
        # law's own course would, and the law is asked at every tick as ever.
        steps = self.compact.held(flown.commands, held)
        self.hold = from_steps(steps, self.terms.signals)
        self._steps = [*steps] * self.terms.ticks_per_sample
        return fly_sample(self.codec, self._state, word, known, lambda _tick, _state: self.hold)

    def _decide(self, tick: int, state: Vector) -> Vector:
        """Ask the controller, limit its command, and return it as sent on the wire."""
        limited = self.terms.limits.apply(self._asker.command(tick, state, self.hold), self.hold)
        steps = to_steps(limited, self.terms.signals)
        self._steps += steps
        self.hold = from_steps(steps, self.terms.signals)
        return self.hold
