"""What the receiver consumed, found out from what comes down: weighted hypotheses, confirmed in time.

The receiver's state X is the truth. Each hypothesis is a copy of X after the last sample heard of,
with all its inputs since the last confirmed sample, and a weight. `heard` lets each of them branch,
and weighs the branches by the down symbols that came (`branches`).

What is not followed any further is not forgotten. Its weight is booked as *rest*, at the first sample
where it leaves the likeliest path, and so is a little of every sample for what no branch explains. To
the rest a hash bit is a coin, so one that agrees with the list halves it, relative to the list;
command symbols are as likely to it as to the list. Hypotheses that have come to the same state are
one from there on, with the likelier history. A sample is confirmed when all that differs from the
likeliest path in it or before it, list and rest, weighs less than `confirmed_below` of the list.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from channel.codec.codec import ERASED, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState
from channel.protocol.events import ASKED, Event
from channel.protocol.frames import Why
from transmitter.session.narrow.branches import Branched, Branching
from transmitter.session.narrow.paths import Node, Paths, Symbols
from transmitter.session.narrow.priors import Priors

APPLIED_SHARE = 1.0 / 256.0
"""Of the list: what weighs less, all together, has no say in what is applied."""
AHEAD_MAX = 4
"""Hypotheses that are carried ahead of what has been heard of."""
LIST_MIN, LIST_MAX = 16, 256
NUMBERS_PER_TICK = 2000
"""What the list may work on. A large model has a short list, so that the transmitter is never late
because of it, and one that depends on no clock. In one sample the list and its likely branches are
flown at most: twice the list, and `AHEAD_MAX` for each word on its way."""
NUMBERS_BESIDE = 100
"""What a sample costs whatever its size."""


class Rejoin(NamedTuple):
    """A request for a common state."""

    why: Why
    """REST, or LAG: no sample was confirmed for too long, or no hypothesis can be continued"""
    details: Event


class Settings(NamedTuple):
    """Numbers of the list."""

    list_max: int = LIST_MAX
    lag_samples_max: int = 470
    dropped_below: float = 2.0**-20
    """of the best hypothesis' weight"""
    confirmed_below: float = 2.0**-32
    """of the list's weight"""
    unexplained: float = 2.0**-24
    """of the list's weight, in each sample"""


class Confirmed(NamedTuple):
    """One sample that is certain."""

    sample: int
    before: TwoWayState
    digest: int
    """of the state before it, which its hash symbols are bits of"""
    word_sent: Word
    word: Word
    """as the receiver consumed it"""
    symbols: tuple[int, ...]
    """all down symbols, as the receiver sent them"""
    heard: tuple[int | None, ...]
    """as they came; None: erased"""
    flown: TwoWaySample
    lag_samples: int
    """samples heard of beyond this one"""
    doubt: float
    """at most the share of other inputs of this sample which led to the same state later, so that
    nothing can tell them apart; 0 with a codec that forgets nothing"""


def longest_list(machine: TwoWay) -> int:
    """Return how many hypotheses are followed at most."""
    allowed = NUMBERS_PER_TICK * machine.codec.ticks_per_sample
    return max(LIST_MIN, min(LIST_MAX, allowed // (machine.numbers + NUMBERS_BESIDE)))


class Hypotheses:
    """The list; see the module's text."""

    def __init__(self, machine: TwoWay, settings: Settings | None = None) -> None:
        self.machine = machine
        self.settings = settings or Settings(list_max=longest_list(machine))
        self.priors = Priors()
        self._branching = Branching(machine, self.priors, self.settings.dropped_below)
        self.rejoin: Rejoin | None = None
        """set when the list cannot go on; until `restart` it then stands still"""
        self.restart(machine.initial())

    def restart(self, state: TwoWayState) -> None:
        """Take a common state; what is known of the line stays known."""
        root = Node(None, state.sample - 1, (), (), state)
        self._paths = Paths(root)
        self._members: list[tuple[float, Node]] = [(1.0, root)]
        self._unheard: deque[Word] = deque()
        self._unconfirmed: deque[tuple[Word, tuple[int | None, ...]]] = deque()
        self._ahead: list[tuple[float, Node]] | None = None
        self.rejoin = None

    # What is known

    @property
    def next_heard(self) -> int:
        """Return the sample whose down symbols are next."""
        return self._paths.tip.sample + 1

    @property
    def next_sample(self) -> int:
        """Return the sample whose word is sent next."""
        return self.next_heard + len(self._unheard)

    @property
    def next_confirmed(self) -> int:
        """Return the first sample that is not certain."""
        return self._paths.first

    @property
    def confirmed_state(self) -> TwoWayState:
        """Return the state before `next_confirmed`."""
        return self._paths.root.state

    @property
    def size(self) -> int:
        return len(self._members)

    @property
    def best(self) -> float:
        """Return the share of the list that the likeliest hypothesis has."""
        return max(weight for weight, _ in self._members)

    @property
    def rest(self) -> float:
        """Return the weight of what is not followed, in units of the list's."""
        return self._paths.total_rest

    def likeliest(self) -> list[Node]:
        """Return the samples from `next_confirmed` on, as the receiver most probably flew them."""
        return [node for node in self._paths.path if node.fly(self.machine)]

    def members(self) -> list[tuple[float, TwoWayState]]:
        """Return the hypotheses: (weight, state before `next_heard`); the weights sum to one."""
        return [(weight, node.state) for weight, node in self._members if node.fly(self.machine)]

    def sabotage(self, change: Callable[[TwoWayState], TwoWayState]) -> None:
        """Change the state of every hypothesis, to see that it is found."""
        for _, node in self._members:
            node.change(self.machine, change)
        self._ahead = None

    # What is used

    def sent(self, word: Word) -> None:
        """Note the word of `next_sample`, ERASED where none was sent."""
        self._unheard.append(word)
        self._ahead = None

    def state_before_next(self) -> CodecState:
        """Return the likeliest codec state before `next_sample`."""
        return self._carried()[0][1].state.codec

    def encode(self, measurement: Vector) -> tuple[int, ...]:
        """Return the word of `next_sample` for a measurement at its first tick.

        Where the hypotheses ask for different words, it is the one that leaves the smallest mean square
        between measurement and prediction, over all of them.
        """
        codec = self.machine.codec
        states = [(weight, node.state.codec) for weight, node in self._carried()]
        words = [codec.encode(state, measurement) for _, state in states]
        best, least = words[0], None
        for word in dict.fromkeys(words) if len(set(words)) > 1 else ():
            square = 0.0
            for weight, state in states:
                corrected = state._replace(model=codec.open(state, word).model)
                for one, other in zip(measurement, codec.predicted(corrected), strict=True):
                    square += weight * (one - other) * (one - other)
            if least is None or square < least:
                best, least = word, square
        return best

    def command(self, tick: int) -> Vector:
        """Return the command to apply at a tick: the weighted mean of what the hypotheses command.

        Hypotheses are carried to the last word sent. What does not follow from these words is the last
        command that does.
        """
        carried = self._carried()
        if len(carried) == 1:
            return self._command_of(carried[0][1], tick)
        commands = [self._command_of(node, tick) for _, node in carried]
        total = sum([weight for weight, _ in carried])
        mean = []
        for values in zip(*commands, strict=True):
            value = (
                sum([weight * one for (weight, _), one in zip(carried, values, strict=True)]) / total
            )
            # Rounding must not carry it beyond a limit that all of them keep.
            mean.append(max(min(values), min(max(values), value)))
        return tuple(mean)

    def _carried(self) -> list[tuple[float, Node]]:
        """Return the hypotheses that count, best first, carried over the words not heard of yet."""
        if self._ahead is not None:
            return self._ahead
        left = 1.0
        kept = []
        for weight, node in self._members:
            kept.append((weight, node))
            left -= weight
            if left < APPLIED_SHARE or (self._unheard and len(kept) == AHEAD_MAX):
                break
        ahead = []
        for weight, node in kept:
            tip = node
            for word in self._unheard:
                if not tip.fly(self.machine):
                    break
                tip = tip.child(word, self._likeliest(tip.state))
            if tip.fly(self.machine):
                ahead.append((weight, tip))
        if not ahead:
            # None can be carried: what comes down next will show it.
            tip = kept[0][1]
            while not tip.is_flown and tip.parent is not None:
                tip = tip.parent
            ahead = [(1.0, tip)]
        self._ahead = ahead
        return ahead

    def _likeliest(self, state: TwoWayState) -> Symbols:
        """Return the command symbols of the next sample, as far as they can be guessed."""
        count = self.machine.commands_in(state)
        return (0 if self.machine.scheme.is_idle(state.down) else None,) * count

    def _command_of(self, node: Node, tick: int) -> Vector:
        """Return a hypothesis' command of a tick."""
        count = self.machine.codec.ticks_per_sample
        one: Node | None = node
        while one is not None:
            ahead = tick - one.state.sample * count
            if 0 <= ahead < len(one.state.commands):
                return one.state.commands[ahead]
            at = tick - self.machine.lead_ticks - one.sample * count
            if 0 <= at < len(one.commands):
                return one.commands[at]
            if ahead >= 0:
                break
            one = one.parent
        return node.state.hold

    # What comes down

    def heard(self, sample: int, symbols: Sequence[int | None] | None) -> list[Confirmed]:
        """Take the down symbols of `next_heard`, None for each that is erased, or ERASED for all.

        Return the samples that are certain now. ValueError for another sample, or another number of
        symbols.
        """
        if self.rejoin is not None:
            return []
        count = self.machine.layout.symbols_per_sample
        heard = (None,) * count if symbols is None else tuple(symbols)
        if sample != self.next_heard or len(heard) != count:
            raise ValueError(
                f"{len(heard)} down symbols of sample {sample} came; those of sample {self.next_heard} "
                f"are next, {count} of them"
            )
        sent = self._unheard[0] if self._unheard else ERASED
        self._ahead = None
        if not self._select(self._branching.of(self._members, sent, heard)):
            self.rejoin = self._rejoin(Why.LAG, "no hypothesis can be continued")
            return []
        if self._unheard:
            self._unheard.popleft()
        self._unconfirmed.append((sent, heard))
        done = self._confirm()
        if self.rest > 1.0:
            self.rejoin = self._rejoin(Why.REST)
        elif len(self._paths.path) > self.settings.lag_samples_max:
            self.rejoin = self._rejoin(Why.LAG)
        return done

    def _rejoin(self, why: Why, detail: str | None = None) -> Rejoin:
        sample, lag = self.next_confirmed, len(self._paths.path)
        return Rejoin(why, replace(ASKED, sample=sample, number=lag, value=self.rest, detail=detail))

    def _select(self, branched: Branched) -> bool:
        """Follow the branches that weigh enough, book the others; return whether there is one."""
        branches, rest_factor, dropped = branched
        if not branches:
            return False
        branches.sort(key=lambda one: -one[0])
        least = branches[0][0] * self.settings.dropped_below
        followed_on: list[tuple[float, Node]] = []
        for weight, node, word, symbols in branches:
            if weight >= least and weight > 0.0 and len(followed_on) < self.settings.list_max:
                followed_on.append((weight, node.child(word, symbols)))
            else:
                dropped.append((weight, node))
        for _, node in self._members:
            node.children = {}
        paths = self._paths
        paths.scale_rest(rest_factor)
        paths.follow(followed_on[0][1])
        paths.book(self.settings.unexplained * rest_factor, None)
        leaves: dict[Node, int | None] = {}
        for weight, node in dropped:
            if weight > 0.0:
                if node not in leaves:
                    leaves[node] = paths.leaves_at(node)
                # The next hash symbol may agree for certain with what differs in two inputs: that
                # halving is undone here.
                paths.book(2.0 * weight, leaves[node])
        total = 0.0
        for weight, _ in followed_on:
            total += weight
        self._members = [(weight / total, node) for weight, node in followed_on]
        paths.scale_rest(1.0 / total)
        return True

    def _confirm(self) -> list[Confirmed]:
        """Confirm what is certain now, learn from it, and drop what differs from it."""
        paths = self._paths
        leaves = [(weight, node, paths.leaves_at(node)) for weight, node in self._members]
        differing = [0.0] * len(paths.path)
        for weight, _, at in leaves:
            if at is not None:
                differing[at - paths.first] += weight
        total, count = paths.old_rest, 0
        for one, rest in zip(differing, paths.rest, strict=True):
            total += one + rest
            if total >= self.settings.confirmed_below:
                break
            count += 1
        if count and not paths.path[count - 1].fly(self.machine):
            count -= 1
        if count == 0:
            return []
        first = paths.first
        before = paths.root
        members = []
        for weight, node, at in leaves:
            if at is None or at >= first + count:
                members.append((weight, node))
            else:
                paths.old_rest += weight
        self._members = members
        done = []
        for node in paths.confirm(count):
            done.append(self._learned(node, before))
            before = node
        return done

    def _learned(self, node: Node, before: Node) -> Confirmed:
        """Return a confirmed sample, and learn from it what the line is like."""
        machine = self.machine
        sent, heard = self._unconfirmed.popleft()
        digest = before.digest(machine)
        commands = tuple([1 if one else 0 for one in node.symbols])
        hashes = machine.hash_symbols(before.state, digest, commands, node.word)
        symbols = commands + hashes
        self.priors.learn(sent, node.word, before.word)
        self.priors.learn_symbols(symbols, heard)
        if commands and machine.scheme.is_idle(before.state.down):
            self.priors.news.count(commands[0] == 1)
        assert node.flown is not None  # only the root has none
        return Confirmed(
            sample=node.sample,
            before=before.state,
            digest=digest,
            word_sent=sent,
            word=node.word,
            symbols=symbols,
            heard=heard,
            flown=node.flown,
            lag_samples=self._paths.tip.sample - node.sample,
            doubt=node.doubted,
        )
