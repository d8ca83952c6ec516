"""Flights from objects: what they return, that they are the configured ones, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from channel.codec.codec import ERASED
from channel.line.line import CleanLine, Delivery
from channel.protocol.wire import DATAGRAM
from tenbaud import Codec, MemoryFlight, MemoryRecorder, Run, Terms, coders, fly, load_preset
from tenbaud.audit.audit import audit
from tenbaud.errors import ConfigError, PartError

TICK_S = 0.01
OFF_MODEL = {"transmitter.plant.mismatch": 0.1}


class Cart:
    """A plant: a double integrator."""

    def __init__(self) -> None:
        self.x, self.v = 0.2, 0.0

    @property
    def measured(self) -> tuple[float, ...]:
        return (self.x,)

    def advance(self, volts: tuple[float, ...]) -> None:
        self.v += TICK_S * volts[0]
        self.x += TICK_S * self.v


class CartModel:
    state_size, correction_size, input_size = 2, 2, 1

    def initial(self) -> tuple[float, ...]:
        return (0.0, 0.0)

    def measured(self, state: tuple[float, ...]) -> tuple[float, ...]:
        return state[:1]

    def tick(self, state: Any, command: Any, held: Any) -> tuple[float, ...]:
        v = state[1] + TICK_S * (command[0] + held[1])
        return (state[0] + TICK_S * (v + held[0]), v)


class Damper:
    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        return (-2.0 * state[0] - 2.0 * state[1],)

    def references(self, tick: int) -> tuple[float | None, ...]:
        return (0.0,)


CODEC = Codec(CartModel(), coders.ZoomCoder(coders.ZoomParameters(window=3)), ticks_per_sample=10)
TERMS = Terms.for_codec(CODEC, TICK_S)


def cart_flight(**options: Any) -> MemoryFlight:
    return MemoryFlight(CODEC, TERMS, Cart(), Damper(), **options)


def test_when_own_objects_fly_then_the_result_has_what_both_ends_saw() -> None:
    flight = cart_flight()
    result = flight.fly(20.0)
    assert result.ticks == 2000
    assert result.ended_by == ""
    assert result.time_s[-1] == pytest.approx(19.99)
    assert result.states.shape == result.live_states.shape == (2000, 2)
    assert result.commands.shape == result.errors.shape == (2000, 1)
    assert result.samples == tuple(range(200))
    assert set(result.words) == {(-1,), (1,)}
    assert result.words == result.words_sent
    assert result.counts["transmitter"]["digest_checks"] == 200
    assert result.counts["receiver"]["erasures"] == 0
    np.testing.assert_array_equal(result.errors[:, 0], result.angles_rad[:, 0] - result.states[:, 0])
    np.testing.assert_array_equal(result.errors, result.live_errors)
    assert np.abs(result.errors[1000:]).max() < 0.1
    assert (result.reference_rad == 0.0).all()
    assert result.digests == tuple(flight.receiver_rows.column("sample", "digest"))
    assert "2000 ticks, 200 samples in lockstep, 0 erased" in repr(result)


def test_when_a_line_loses_a_symbol_then_its_word_is_an_erasure() -> None:
    class Lossy(CleanLine):
        def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
            lost = DATAGRAM.is_symbol(data) and now_ns == 5 * TERMS.sample_ns
            return [Delivery(now_ns, None if lost else data)]

    terms = Terms.for_codec(CODEC, TICK_S, lead_ticks=3)
    result = MemoryFlight(CODEC, terms, Cart(), Damper(), uplink_line=Lossy()).fly(2.0)
    assert [sample for sample, word in enumerate(result.words) if word is ERASED] == [5]
    assert result.words_sent[5] is not None
    assert result.counts["receiver"]["erasures"] == 1


def test_when_recorders_are_given_then_they_take_every_row() -> None:
    own, far = MemoryRecorder(), MemoryRecorder()
    flight = cart_flight(recorder=own, receiver_recorder=far)
    flight.fly(2.0)
    assert own.rows == flight.transmitter_rows.rows
    assert far.rows == flight.receiver_rows.rows
    assert len(own.topic("tick")) == 200
    assert len(far.topic("sample")) == 20


def test_when_a_flight_has_flown_then_it_does_not_fly_again() -> None:
    flight = cart_flight()
    flight.fly(1.0)
    with pytest.raises(RuntimeError, match="flies once"):
        flight.fly(1.0)
    with pytest.raises(ValueError, match="less than one tick"):
        cart_flight().fly(0.001)


class Mute:
    def references(self, tick: int) -> tuple[float | None, ...]:
        return (None,)


class Hasty(Damper):
    def command(self, tick: int) -> tuple[float, ...]:  # type: ignore[override]
        return (0.0,)


class Growing(coders.ZoomCoder):
    def decode(self, coder: Any, state: Any, word: Any) -> Any:
        correction, after = super().decode(coder, state, word)
        return correction, (*after, 1.0)


class TwoAngles(Cart):
    measured = (0.0, 0.0)  # type: ignore[assignment]


GROWING = Codec(CartModel(), Growing(coders.ZoomParameters()), 10)
NOT_ONE = Codec(CartModel(), coders.ZoomCoder(coders.ZoomParameters()), 5)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"controller": Mute()}, r"the controller \(Mute\) .* it has no method command\(tick, state\)"),
        ({"controller": Hasty()}, r"its method command must take \(tick, state\), not \(tick\)"),
        ({"controller": Damper}, r"is the class Damper; give an object of it, Damper\(\.\.\.\)"),
        ({"plant": object()}, r"no attribute measured \(tuple.*\); it has no method adv"),
        ({"plant": TwoAngles()}, r"measures 2 angle\(s\) and the model \(CartModel\) predicts 1"),
        ({"codec": CartModel()}, r"\(CartModel\) is no Codec: give Codec\(model, coder, ticks"),
        ({"codec": GROWING}, "the number of states changed within a sample"),
        ({"codec": NOT_ONE}, r"terms.ticks_per_sample is 10, and the codec's is 5; Terms.for_codec"),
    ],
)  # fmt: skip
def test_when_an_object_lacks_something_then_the_error_names_it(parts: Any, words: str) -> None:
    given = {"codec": CODEC, "terms": TERMS, "plant": Cart(), "controller": Damper()} | parts
    with pytest.raises((PartError, ValueError), match=words):
        MemoryFlight(**given)


def digests_of(run: Run) -> list[str]:
    return [row["digest"] for row in run.table("transmitter", "sample").rows]


def test_when_a_presets_parts_fly_then_the_states_are_those_of_the_preset(tmp_path: Path) -> None:
    parts = load_preset("tuned-10baud", OFF_MODEL)
    result = MemoryFlight(parts.codec, parts.terms, parts.plant, parts.controller).fly(20.0)
    settings = {**OFF_MODEL, "duration_s": 20.0}
    named = fly("tuned-10baud", settings=settings, out=tmp_path / "named")
    assert list(result.digests) == digests_of(named)

    # The same parts as objects in a recorded flight.
    parts = load_preset("tuned-10baud", OFF_MODEL)
    run = fly(
        "tuned-10baud",
        settings=settings,
        out=tmp_path / "objects",
        model=parts.codec.model,
        coder=parts.codec.coder,
        plant=parts.plant,
        controller=parts.controller,
    )
    assert digests_of(run) == digests_of(named)
    assert run.config.receiver.controller == "object:PidLoops"
    np.testing.assert_array_equal(run.error_live, named.error_live)


def test_when_a_controller_was_an_object_then_an_audit_says_that_it_is_not_kept(tmp_path: Path) -> None:
    parts = load_preset("tuned-10baud")
    fly(
        "tuned-10baud",
        settings={"duration_s": 5.0},
        out=tmp_path / "run",
        controller=parts.controller,
    )
    found = audit(tmp_path / "run")
    assert not found.passed
    assert not found.leaks
    assert "was an object in a program, and a recording does not keep objects" in " ".join(found.gaps)


def test_when_parts_do_not_fit_a_flight_then_fly_says_so() -> None:
    with pytest.raises(PartError, match=r"the controller .* no method command\(tick, state\)"):
        fly("tuned-10baud", controller=Mute())  # type: ignore[arg-type]
    with pytest.raises(PartError, match=r"controller: an object stays in this process.*module:Class"):
        fly("tuned-10baud", controller=Damper(), link="zenoh")
    with pytest.raises(ConfigError, match="there is no module nowhere"):
        fly("tuned-10baud", controller="nowhere:Law")
