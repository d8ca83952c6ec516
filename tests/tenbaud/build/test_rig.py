from __future__ import annotations

import math
import time
from typing import Any

import pytest
import typer

from plant_sim.encoder import Encoder
from tenbaud.build.emulator import EmulatedFormat, build_emulator
from tenbaud.build.flight import agree
from tenbaud.build.rig import build_axes, build_rig, quarc_commands, quarc_fields
from tenbaud.cli import options
from tenbaud.config.load import ConfigError, dump_config, load_config
from tenbaud.design.complete import completed
from transmitter.rigs.base import RigError
from transmitter.rigs.quarc import QuarcBridge
from transmitter.rigs.serial_bridge import SerialBridge
from transmitter.rigs.simulated import DryRig, SimulatedRig


def configured(rig: str, **changes: Any) -> Any:
    values = options.overrides(rig=rig)
    values["transmitter"].update(changes)
    return load_config(None, None, values)


@pytest.mark.parametrize("form", ["cobs", "ascii"])
def test_a_serial_rig_is_named_by_its_format_and_port(form: str) -> None:
    rig = build_rig(configured(f"{form}:/dev/ttyACM3"))
    assert isinstance(rig, SerialBridge)
    assert rig.name == f"{form} at /dev/ttyACM3"
    assert rig.is_real
    assert rig.ramps_down


def test_a_quarc_rig_is_named_by_its_role_and_address() -> None:
    client = build_rig(configured("quarc:10.0.0.5:18000"))
    server = build_rig(configured("quarc-server:9095"))
    assert isinstance(client, QuarcBridge)
    assert (client.name, server.name) == (
        "QUARC client at 10.0.0.5:18000",
        "QUARC server at 127.0.0.1:9095",
    )


def test_setting_one_field_of_an_axis_keeps_its_others() -> None:
    config = configured("cobs:X", bridge={"pitch": {"sign": -1}, "travel": {"zero_counts": 3}})
    travel, pitch, elevation = build_axes(config)
    assert (travel.channel, travel.counts_per_turn, travel.sign, travel.zero_counts) == (0, 8192, 1, 3)
    assert (pitch.channel, pitch.counts_per_turn, pitch.sign) == (1, 4096, -1)
    assert (elevation.channel, elevation.sign) == (2, -1)


@pytest.mark.parametrize("rig", ["cobs:X", "hil", "quarc:h:1"])
def test_an_output_that_is_a_state_is_wired_under_its_name(rig: str) -> None:
    model = {"kind": "linear", "F": [[1.0, 0.01], [0.0, 1.0]], "E": [[0.0], [0.01]], "C": [[1.0, 0.0]]}
    values = options.overrides(rig=rig) | {"model": {**model, "states": ["arm", "rate"]}}

    def axes(**sections: Any) -> list[tuple[str, int, int]]:
        values["transmitter"]["bridge"] = sections
        found = build_axes(load_config(None, None, {**values, "coder": {"kind": "direction"}}))
        return [(axis.name, axis.channel, axis.sign) for axis in found]

    assert axes() == [("arm", 0, 1)]
    assert axes(arm={"channel": 2, "sign": -1}) == [("arm", 2, -1)]
    for name in ("pitch", "output_1"):
        with pytest.raises(ConfigError, match=rf"bridge\.{name}: the wired axes are arm"):
            axes(**{name: {"sign": -1}})


def test_a_pitch_axis_is_disturbed_in_one_place() -> None:
    plant = {"disturbance": "q=1e-3:2e-6"}
    with pytest.raises(ConfigError, match="2 values, and this plant is disturbed in 1 place"):
        build_rig(load_config(None, None, {"transmitter": {"plant": plant}}))


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_simulated_output_that_is_no_number_is_named_with_its_tick(value: float) -> None:
    class Diverged:
        measured = (0.0, value)

        def advance(self, volts: tuple[float, ...]) -> None:
            pass

    rig = SimulatedRig(Diverged(), (Encoder(4096),) * 2, (0.0,), ("arm", "pole"))
    with pytest.raises(RigError, match=rf"output pole is {value} at tick 7"):
        rig.read(7)


def test_a_dry_run_wraps_any_rig() -> None:
    rig = build_rig(load_config(None, None, {"transmitter": {"dry_run": True}}))
    assert isinstance(rig, DryRig)
    rig.write(0, (5.0, -5.0))
    reading = rig.read(100)
    assert reading is not None
    assert reading.applied_volts == (0.0, 0.0)
    driven = SimulatedRig(rig._rig._plant, (), (0.0, 0.0))  # type: ignore[attr-defined]
    assert driven._plant.state[2:] == (0.0, 0.0), "no voltage reached its motors"  # type: ignore[attr-defined]


def test_quarc_vectors_follow_the_wiring() -> None:
    config = configured(
        "quarc:h:1",
        bridge={"motors": {"channels": [1, 0]}, "elevation": {"channel": 4}},
        quarc={"fields": ["seq", "elevation", "-", "pitch"], "command_fields": ["front", "enable"]},
    )
    assert quarc_fields(config) == ("seq", "c4", "-", "c1")
    assert quarc_commands(config) == ("v1", "enable")


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"bridge": {"axes": ["travel"]}}, "pitch must be among them"),
        ({"quarc": {"fields": ["travel"]}}, "the output pitch is not among them"),
        ({"quarc": {"fields": ["pitch", "height"]}}, "height"),
    ],
)
def test_a_vector_or_wiring_without_the_pitch_is_refused(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        build_rig(configured("quarc:h:1", **changes))


def test_an_emulated_rig_has_the_encoder_of_its_output_whatever_it_is_called() -> None:
    model = {"kind": "linear", "C": [[1.0, 0.0]], "outputs": ["tilt"], "output_units": ["rad"]}
    model |= {"A": [[0.0, 1.0], [-0.5, -0.1]], "B": [[0.0, 0.0], [0.35, -0.35]]}
    values = completed({"model": model})
    values["transmitter"] = {"bridge": {"tilt": {"channel": 3}}}
    with pytest.raises(ConfigError, match=r"0 to 2, .* tilt is at 3: set .*bridge\.tilt\.channel"):
        build_emulator(load_config(None, None, values), "quarc", "pty")
    for channel in (0, 2):
        values["transmitter"] = {"bridge": {"tilt": {"channel": channel}}}
        config = load_config(None, None, values)
        device = build_emulator(config, "quarc", "pty", faults=("jump=50@0",)).device
        now_ns = time.monotonic_ns()
        device.command(now_ns, (0.0, 0.0), True)
        device.sample(now_ns)
        counts = device.sample(now_ns).counts
        assert [place for place, one in enumerate(counts) if one == 50] == [channel]


@pytest.mark.parametrize(
    ("form", "transmitter", "text"),
    [
        ("qsb", {}, "qsb has one encoder, .* 3 outputs: travel, elevation, pitch"),
        ("cobs", {"bridge": {"pitch": {"channel": 0}}}, "travel and pitch are both on channel 0"),
        ("cobs", {"rig": "serial", "serial": {"port": "X", "format": "qsb"}}, "qsb has one encoder"),
    ],
)
def test_outputs_that_share_an_encoder_are_refused_with_their_names(
    form: EmulatedFormat, transmitter: dict[str, Any], text: str
) -> None:
    config = load_config("helicopter-10baud", None, {"transmitter": transmitter})
    with pytest.raises(ConfigError, match=text):
        build_emulator(config, form, "pty")


def test_columns_that_make_no_sample_name_the_section() -> None:
    with pytest.raises(ConfigError, match=r"transmitter\.serial: columns"):
        build_rig(configured("ascii:X", serial={"port": "X", "format": "ascii", "columns": ["t_us"]}))


def test_a_real_rig_has_no_virtual_clock() -> None:
    with pytest.raises(ConfigError, match="--clock real"):
        agree(configured("cobs:X"), "virtual")
    assert agree(configured("cobs:X"), "real").clock == "real"


def test_every_rig_setting_survives_the_config_file(tmp_path: Any) -> None:
    config = configured("ascii:X", bridge={"pitch": {"zero_counts": "first"}, "stale_s": 0.2})
    path = tmp_path / "config.toml"
    path.write_text(dump_config(config))
    assert load_config(None, path) == config


def test_a_rig_does_not_change_what_both_ends_agree_on() -> None:
    assert agree(configured("cobs:X"), "real").identity == agree(load_config(), "real").identity


@pytest.mark.parametrize("rig", ["cobra:/dev/ttyACM0", "quarc:10.0.0.5", "cobs", "replay"])
def test_when_a_rig_is_named_that_there_is_not_then_the_forms_are_shown(rig: str) -> None:
    with pytest.raises(typer.BadParameter, match=r"cobs:PORT|quarc:HOST:PORT|replay:FILE"):
        options.overrides(rig=rig)
