"""A plant of two outputs in different units and one input, flown by configuration alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tenbaud import Run
from tenbaud.audit.audit import audit
from tests.tenbaud.processes import run as run_command

CART = '''
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.signals import InputSignal, Signal, Signals

TICK_S = 0.01

class Cart:
    """A cart with a pendulum that hangs from it; the force on the cart is the one input."""

    state_size, correction_size, input_size = 4, 4, 1
    signals = Signals(
        (
            Signal("position", "m"),
            Signal("tilt", "rad"),
            Signal("speed", "m/s"),
            Signal("tilt_rate", "rad/s"),
        ),
        (InputSignal("force", "N", -20.0, 20.0),),
        (Signal("position", "m", -2.0, 2.0), Signal("tilt", "rad", -1.0, 1.0)),
    )

    def __init__(self, context):
        pass

    def initial(self):
        return (0.0, 0.0, 0.0, 0.0)

    def measured(self, state):
        return state[:2]

    def tick(self, state, command, held):
        x, a, v, w = state
        return (
            x + TICK_S * v,
            a + TICK_S * w,
            v + TICK_S * (command[0] - 0.5 * v),
            w + TICK_S * (-4.0 * a - 0.6 * w - 0.8 * command[0]),
        )

class Plant:
    def __init__(self, context):
        self.model = Cart(None)
        self.state = (0.05, 0.02, 0.0, 0.0)

    @property
    def measured(self):
        return self.state[:2]

    def advance(self, volts):
        self.state = self.model.tick(self.state, volts, (0.0,) * 4)

class TwoSigns(ZoomCoder):
    def __init__(self, context):
        gains = ((0.6, 0.0), (0.0, 0.6), (3.0, 0.0), (0.0, 3.0))
        super().__init__(ZoomParameters(0.02, 0.003, 0.9, 3, gains, impulse=True))
'''

FLIGHT = """
preset = "tuned-10baud"
duration_s = 20.0
channel.rate_baud = 20.0
model.kind = "cart:Cart"
coder.kind = "cart:TwoSigns"
limits.command_max = 5.0

[transmitter]
plant.kind = "cart:Plant"
soft_limits = { position = 2.0, tilt = 1.0 }
encoders.position.counts_per_unit = 5000.0

[receiver]
controller = "state_feedback"
state_feedback.integral_weights = { position = 0.5 }

[receiver.reference]
kind = "square"
amplitude = 0.5
period_s = 10.0
"""


@pytest.fixture
def flown(tmp_path: Path) -> Path:
    (tmp_path / "cart.py").write_text(CART)
    (tmp_path / "flight.toml").write_text(FLIGHT)
    arguments = ("--config", "flight.toml", "--link", "zenoh", "--out", "run")
    done = run_command("demo", *arguments, cwd=tmp_path)
    assert done.code == 0, done.err
    return tmp_path / "run"


def test_every_output_is_scored_recorded_and_audited_under_its_name(
    flown: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(flown.parent)
    outputs = json.loads((flown / "summary.json").read_text())["outputs"]
    assert list(outputs) == ["position", "tilt"]
    assert [one["unit"] for one in outputs.values()] == ["m", "rad"]
    assert all(0.0 < one["error_coded_rms"] < 0.01 for one in outputs.values())
    assert outputs["position"]["tracking_rms"] > 0.0
    assert outputs["tilt"]["tracking_rms"] is None
    run = Run(flown)
    assert {"position", "tilt", "force", "reference_position"} <= run.signals.keys()
    steps = run.signals["measured_position"].values * 5000.0
    assert abs(steps - steps.round()).max() < 1e-6, "read in counts of its own encoder"
    result = audit(flown, allow_code=True)
    assert result.passed, result.leaks + result.gaps
