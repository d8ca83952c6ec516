"""A recorded flight is read, converted and drawn with the names and units of its plant."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from channel.codec.coders.zoom import ZoomCoder
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.codec.signals import InputSignal, Signal, Signals
from tenbaud import FlightResult, Run, fly
from tenbaud.flight.closing import closing_lines
from tenbaud.recording.convert import convert
from tenbaud.recording.encoding import SIGNALS_KEY, recorded_signals, signals_text
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.layouts import TOPIC, flight_plots
from tenbaud.recording.overview import Overview, packed, unpacked
from tenbaud.recording.reader import Recording
from tenbaud.recording.signals import definitions
from tests.tenbaud.arm_and_place import ZOOM, Law, Model, Plant, fly_recorded


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[FlightResult, Run]:
    return fly_recorded(tmp_path_factory.mktemp("runs") / "run")


@pytest.fixture(scope="module")
def run(flown: tuple[FlightResult, Run]) -> Run:
    return flown[1]


def test_the_recording_itself_says_what_the_signals_are_called(run: Run) -> None:
    assert run.plant == Model.signals
    assert recorded_signals(Run(run.folder.receiver).metadata) == Model.signals
    units = {"arm": "rad", "place": "m", "torque": "N m", "estimate_speed": "m/s", "range_place": "m"}
    assert units.items() <= run.units.items()
    assert not {"pitch", "front", "rear", "measured", "estimate"} & set(run.names)


def test_signals_are_what_was_flown(flown: tuple[FlightResult, Run]) -> None:
    result, run = flown
    for place, name in enumerate(("arm", "place")):
        values = {
            "": result.angles_rad,
            "measured_": result.measured_rad,
            "error_coded_": result.errors,
        }
        for prefix, expected in values.items():
            found = getattr(run, f"{prefix}{name}")[: result.ticks]
            np.testing.assert_array_equal(found, expected[:, place])
    np.testing.assert_array_equal(run.torque[: result.ticks], result.commands[:, 0])
    np.testing.assert_array_equal(run.estimate_arm_rate[: result.ticks], result.states[:, 2])
    assert run.reference_arm[20] == 0.1


def test_a_flight_of_objects_has_figures_of_every_output(tmp_path: Path) -> None:
    settings = {"duration_s": 5.0, "channel.rate_baud": 40.0}
    parts = {"model": Model(), "coder": ZoomCoder(ZOOM), "plant": Plant(), "controller": Law()}
    run = fly("paper-20baud", settings=settings, out=tmp_path / "run", **parts)
    assert run.plant == Model.signals
    outputs = run.summary["outputs"]
    assert [(name, one["unit"]) for name, one in outputs.items()] == [("arm", "rad"), ("place", "m")]
    window = round(run.summary["window_start_s"] * 100)
    for name, one in outputs.items():
        largest = np.nanmax(np.abs(getattr(run, f"error_live_{name}")[window:]))
        assert one["error_live_max"] == pytest.approx(largest)
    text = "\n".join(closing_lines(run.summary, run.folder))
    assert "Estimate error  arm: " in text
    assert "° rms" in text
    assert " m rms, " in text


def test_converted_files_have_its_names_and_units(run: Run, tmp_path: Path) -> None:
    convert(run, "csv", tmp_path / "csv")
    with (tmp_path / "csv" / "flight.csv").open(newline="") as stream:
        names = next(csv.reader(stream))
    assert {"arm_rad", "place_m", "torque_N_m", "estimate_arm_rate_rad_per_s"} <= set(names)
    convert(run, "json", tmp_path / "flight.json")
    signals = json.loads((tmp_path / "flight.json").read_text())["signals"]
    assert (signals["place"]["unit"], signals["torque_command"]["unit"]) == ("m", "N m")
    assert signals["place"]["values"] == run.place.tolist()
    convert(run, "mat", tmp_path / "flight.mat")
    assert loadmat(tmp_path / "flight.mat", simplify_cells=True)["torque"]["unit"] == "N m"


def test_each_symbol_says_which_output_it_was_about(run: Run) -> None:
    rows = [row for _, row in Recording(run.folder.transmitter).rows("sample")]
    assert all(row["about"] == (None if row["word"] is None else [0, 1]) for row in rows)
    assert run.about[:10].tolist() == [0.0] * 5 + [1.0] * 5
    legend = run.plot().axes[-1].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["arm 50%", "place 50%"]


def test_the_figure_of_many_bits_shows_the_share_that_was_about_each_output(run: Run) -> None:
    rows = {
        "word": [[1], [-1], [1], [1]] * 400,
        "about": [[0], [0], [0], [1]] * 400,
    }
    overview = Overview(run.plant)
    overview.add("sample", [at * 100_000_000 for at in range(1600)], rows)
    stored = unpacked(packed(overview), run.plant)
    assert stored is not None
    for one in (overview, stored):
        shares = [means.curve()[1] for means in one.about]
        assert one.symbols.thinned
        assert len(shares[0]) < 1300
        assert [share.mean() for share in shares] == pytest.approx([0.75, 0.25], abs=0.02)


def test_a_summary_has_the_share_of_symbols_about_each_output(tmp_path: Path) -> None:
    settings = {"duration_s": 2.0, "channel.rate_baud": 40.0}
    parts = {"model": Model(), "coder": ZoomCoder(ZOOM), "plant": Plant(), "controller": Law()}
    run = fly("paper-20baud", settings=settings, out=tmp_path / "run", **parts)
    assert [one["symbols_share"] for one in run.summary["outputs"].values()] == [0.5, 0.5]


def test_the_figure_has_a_panel_for_each_group_of_outputs_and_for_the_input(run: Run) -> None:
    labels = [panel.get_ylabel() for panel in run.plot().axes]
    ranges = [r"range $M_k$: arm, rad", r"range $M_k$: place, m"]
    errors = ["error: arm, rad", "error: place, m"]
    assert labels == ["arm, rad", "place, m", *errors, *ranges, "torque, N m", "bits"]


def test_outputs_of_one_group_share_a_panel_and_a_dollar_is_no_equation(tmp_path: Path) -> None:
    grouped = Signals(
        Model.signals.states,
        (InputSignal("torque", "$x_$"),),
        (Signal("arm", "rad", group="both"), Signal("place", "rad", group="both")),
    )
    _, run = fly_recorded(tmp_path / "run", 2.0, grouped)
    figure = run.plot(tmp_path / "flight.png")
    assert figure.axes[0].get_ylabel() == "both, rad"
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert {"arm", "place"} < {text.get_text() for text in legend.get_texts()}


def test_every_curve_of_the_layouts_is_recorded(run: Run, tmp_path: Path) -> None:
    recording = convert(run, "mcap", tmp_path / "flight.mcap")[0]
    plots = flight_plots(run)
    titles = ["arm, rad", "place, m", "error: arm, rad", "error: place, m"]
    assert [plot.title for plot in plots][:4] == titles
    for curve in (curve for plot in plots for curve in plot.curves):
        rows = [row[curve.field] for _, row in Recording(recording).rows(TOPIC)]
        assert any(value is not None for value in rows), curve


def test_a_recording_that_describes_nothing_is_of_the_pitch() -> None:
    assert recorded_signals({}) == PITCH_SIGNALS
    assert recorded_signals({SIGNALS_KEY: signals_text(PITCH_SIGNALS)}) == PITCH_SIGNALS
    assert {"pitch", "front_command", "estimate_rate"} <= set(definitions(PITCH_SIGNALS))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[]", "description of the signals is wrong"),
        ('{"states":[],"inputs":[],"outputs":[{"name":"No"}]}', "'No' is no name of a signal"),
        ('{"states":[],"inputs":[],"outputs":[{"name":"a","unit":"\\u0007"}]}', "not plain text"),
        ('{"states":[],"inputs":[],"outputs":[{"name":"a"}],"output_states":[3]}', "no state 3"),
        (signals_text(Signals(tuple(Signal(f"s{n}") for n in range(200)), (), ())), "more signals"),
    ],
)
def test_a_description_that_no_node_writes_is_refused(text: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        recorded_signals({SIGNALS_KEY: text})


def test_a_name_that_is_one_of_ours_or_given_twice_gets_an_underscore() -> None:
    plant = Signals((Signal("late"),), (InputSignal("late"), InputSignal("range")), (Signal("late"),))
    names = list(definitions(plant))
    assert len(names) == len(set(names))
    assert {"late", "late_", "late__", "range", "range_"} <= set(names)
