"""Parts from outside the tree: loaded by `module:Class`, flown by two processes, refused in words."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from tenbaud import Run
from tenbaud.audit.audit import audit
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import check_parts
from tenbaud.build.flight import agree
from tenbaud.build.preset import load_preset
from tenbaud.config.load import ConfigError, load_config, nested
from tenbaud.config.schema import FlightConfig
from tenbaud.flight.fly import fly
from tests.tenbaud.processes import run as run_command

OUTSIDE = '''
from channel.codec.codec import ERASED, Alphabet

class Law:
    """A controller: proportional, with a bias that its options set."""
    def __init__(self, context, bias=0.0):
        self.context, self.bias = context, bias
    def command(self, tick, state):
        volts = 3.0 * (self.context.reference.value(tick) - state[0]) - 3.0 * state[1] + self.bias
        return (volts / 2.0, -volts / 2.0)
    def references(self, tick):
        return (self.context.reference.value(tick),)

class OneMotor(Law):
    def command(self, tick, state):
        return [1.0]

class Raising(Law):
    def command(self, tick, state):
        return {}["gain"]

class Cart:
    """A plant: a double integrator with friction."""
    def __init__(self, context, friction=0.5):
        self.h, self.friction = context.step_s, friction
        self.x, self.v = (*context.initial, 0.0)[0], 0.0
    @property
    def measured(self):
        return (self.x,)
    def advance(self, volts):
        self.v += self.h * (0.4 * (volts[0] - volts[1]) - self.friction * self.v)
        self.x += self.h * self.v

class CartModel:
    """What both codecs predict with."""
    state_size, correction_size, input_size = 2, 2, 2
    def __init__(self, context, friction=0.5):
        self.h, self.friction = context.tick_s, friction
    def initial(self):
        return (0.0, 0.0)
    def measured(self, state):
        return state[:1]
    def tick(self, state, command, held):
        x, v = state
        v = v + self.h * (0.4 * (command[0] - command[1]) - self.friction * v + held[1])
        return (x + self.h * (v + held[0]), v)

class Steps:
    """A coder: a fixed step up or down."""
    impulse = True
    def __init__(self, context, step=0.02):
        self.step, self.alphabet = step, Alphabet((-1, 1), 1)
    def initial(self):
        return (self.step,)
    def encode(self, coder, predicted, measurement):
        return (1 if measurement[0] >= predicted[0] else -1,)
    def decode(self, coder, state, word):
        error = 0.0 if word is ERASED else coder[0] * word[0]
        return (error, 2.0 * error), coder
    def ranges(self, coder):
        return coder

class Deaf:
    def __init__(self, context):
        pass
    def command(self, tick):
        return (0.0, 0.0)

class Ahead(Steps):
    """A coder that asks where the angle will be, for which it needs the rate."""
    uses_rates = True
    def encode(self, coder, predicted, measurement):
        ahead = measurement[0] - predicted[0] + 0.1 * (measurement[1] - predicted[1])
        return (1 if ahead >= 0.0 else -1,)

class Growing(Steps):
    def decode(self, coder, state, word):
        return (0.0, 0.0), (*coder, 1.0)

class Picky:
    def __init__(self, context):
        raise RuntimeError("not today")

NUMBER = 3
'''

ALL_OUTSIDE = {
    "receiver.controller": "outside:Law",
    "receiver.controller_options.bias": 0.1,
    "transmitter.plant.kind": "outside:Cart",
    "transmitter.plant.options.friction": 0.6,
    "model.kind": "outside:CartModel",
    "coder.kind": "outside:Steps",
    "coder.options.step": 0.03,
}


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a module in it, as the working folder."""
    (tmp_path / "outside.py").write_text(OUTSIDE)
    (tmp_path / "needy.py").write_text("import a_library_that_nobody_has\n")
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "needy.py").write_text("import pack.forgotten\n")
    (tmp_path / "broken.py").write_text("def f(:\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    for name in ("outside", "needy", "broken", "pack", "pack.needy"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


def own(settings: dict[str, Any]) -> FlightConfig:
    """Return the configuration of a flight of one's own."""
    return load_config(overrides=nested(settings), allow_code=True)


def test_one_of_each_flies_as_two_processes(outside: Path) -> None:
    settings = [part for name, value in ALL_OUTSIDE.items() for part in ("--set", f"{name}={value}")]
    done = run_command("demo", "--json", "--duration", "20", "--out", "run", *settings, cwd=outside)
    assert done.code == 0, done.err
    assert done.summary["link"] == "zenoh"
    assert done.summary["plant"] == "outside:Cart"
    assert done.summary["coder_bits_up"] == 200
    assert done.summary["desyncs"] == 0
    run = Run(outside / "run")
    assert run.config.coder.kind == "outside:Steps"
    assert abs(run.error_coded[1000:]).max() < 0.3
    assert abs(run.output_1).max() > 1.0
    assert set(run.range) == {0.03}
    # The recording knows enough to fly it all again, from outside classes too.
    assert audit(outside / "run", allow_code=True).passed


def test_options_reach_the_class_and_count_in_the_handshake(outside: Path) -> None:
    one, other = (
        agree(own({**ALL_OUTSIDE, "coder.options.step": step}), "virtual") for step in (0.03, 0.04)
    )
    assert one.codec.initial().coder == (0.03,)
    assert one.identity.config_digest != other.identity.config_digest
    controller = build_controller(one.config)
    (set_point,) = controller.references(0)
    assert set_point is not None
    assert controller.command(0, (set_point, 0.0)) == (0.05, -0.05)


def test_a_named_controller_is_tried_on_the_model_that_is_an_object(outside: Path) -> None:
    model = load_preset("tuned-10baud").codec.model
    given: dict[str, Any] = {"settings": {"duration_s": 1.0}, "out": outside / "run"}
    run = fly("tuned-10baud", model=model, controller="outside:Law", **given)
    assert run.summary["desyncs"] == 0


def test_a_coder_that_uses_rates_is_given_them(outside: Path) -> None:
    settings = {"coder.kind": "outside:Ahead", "duration_s": 10.0}
    run = fly("tuned-10baud", settings=settings, out=outside / "run")
    assert run.summary["coder_bits_up"] == 100
    assert audit(outside / "run", allow_code=True).passed


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("receiver.controller", "nowhere:Law", "there is no module nowhere"),
        ("receiver.controller", "nowhere.inner:Law", "there is no module nowhere.inner"),
        ("receiver.controller", "pack.needy:Law", "needs pack.forgotten"),
        ("receiver.controller", "outside:Lav", r"no class 'Lav'; did you mean Law\?"),
        ("receiver.controller", "outside:NUMBER", "no class 'NUMBER'"),
        (
            "receiver.controller",
            "outside:Deaf",
            r"its method command must take \(tick, state\), not \(tick\); it has no method ref",
        ),
        ("receiver.controller", "outside:OneMotor", r"2 finite value.* returned \[1\.0\]"),
        ("receiver.controller", "outside:Raising", r"2 value\(s\); it raised KeyError: 'gain'"),
        ("receiver.controller", "outside:Picky", "Picky.context. failed: RuntimeError: not today"),
        ("receiver.controller", "needy:Law", "needs a_library_that_nobody_has"),
        ("receiver.controller", "broken:Law", "broken cannot be imported: SyntaxError"),
        ("receiver.controller", "pidd", r"state_feedback and module:Class; did you mean pid\?"),
        ("receiver.controller", "a b:C", "a class from outside is written module:Class"),
        (
            "transmitter.plant.kind",
            "outside:Law",
            r"it has no attribute measured \(.*float.*\); it has no method advance\(volts\)",
        ),
        ("coder.kind", "outside:Law", r"is no coder: it has no attribute alphabet \(Alphabet\)"),
        ("coder.kind", "outside:Growing", "cannot run one sample: .* number of states changed"),
        ("model.kind", "outside:Steps", r"it has no attribute state_size \(int\)"),
        ("coder.kind", "zom", r"= 'zom': known are zoom, .* and module:Class; did you mean zoom\?"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_in_words(
    outside: Path, name: str, value: str, words: str
) -> None:
    with pytest.raises(ConfigError, match=words) as told:
        check_parts(agree(own({name: value}), "virtual").config)
    assert name in str(told.value)


def test_wrong_options_name_the_context_and_what_it_offers(outside: Path) -> None:
    settings = {"receiver.controller": "outside:Law", "receiver.controller_options.gain": 2.0}
    with pytest.raises(ConfigError, match=r"Law\(context, gain=2.0\) failed: TypeError") as told:
        build_controller(own(settings))
    assert "ControllerContext: tick_s, references, command_max, initial_command" in str(told.value)


def test_the_command_line_says_it_in_one_message(outside: Path) -> None:
    done = run_command("demo", "--set", "receiver.controller=outside:Lav", cwd=outside)
    assert done.code == 2
    assert "Traceback" not in done.err
    assert "did you mean Law?" in done.err
    assert not (outside / "runs").exists()
