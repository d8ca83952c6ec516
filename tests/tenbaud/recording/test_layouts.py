"""A layout with a wrong name shows an empty plot and says nothing, so the names are looked up here.

How a name is read is the viewers' own rule: Foxglove's is `topic.field[index]`, PlotJuggler's, for JSON
messages, `topic/field[index]`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tenbaud import Run
from tenbaud.files.whole import WriteError
from tenbaud.recording.convert import convert
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.layouts import (
    layout_paths,
)
from tenbaud.recording.reader import Recording
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import REPOSITORY

LAYOUTS = REPOSITORY / "examples" / "layouts"
FOXGLOVE_PATH = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?")
PLOTJUGGLER_NAME = re.compile(r"(\w+)/(\w+)(?:\[(\d+)\])?")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "run", duration_s=3.0)


def assert_is_recorded(recording: Path, topic: str, field: str, index: str | None) -> None:
    rows = [row for _, row in Recording(recording).rows(topic)]
    assert rows, f"no topic {topic}"
    values = [row[field] for row in rows if row[field] is not None]
    if index is not None:
        values = [value[int(index)] for value in values]
    assert values, f"{topic}.{field} was never recorded"
    assert all(isinstance(value, int | float) for value in values)


def foxglove_values(layout: str) -> list[str]:
    document = json.loads(layout)
    assert {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"} <= document.keys()
    panels, node = [], document["layout"]
    while isinstance(node, dict):
        assert node["direction"] == "column"
        assert 0.0 < node["splitPercentage"] < 100.0
        panels.append(node["first"])
        node = node["second"]
    panels.append(node)
    assert panels == list(document["configById"])
    assert all(name.startswith("Plot!") for name in panels)
    return [path["value"] for panel in document["configById"].values() for path in panel["paths"]]


def plotjuggler_names(layout: str, recording: str) -> list[str]:
    root = ElementTree.fromstring(layout)
    splitter = root.find("tabbed_widget/Tab/Container/DockSplitter")
    assert splitter is not None
    plots = splitter.findall("DockArea/plot")
    assert int(splitter.attrib["count"]) == len(plots) == len(splitter.attrib["sizes"].split(";"))
    assert sum(map(float, splitter.attrib["sizes"].split(";"))) == pytest.approx(1.0, abs=1e-4)
    file = root.find("previouslyLoaded_Datafiles/fileInfo")
    assert file is not None
    assert file.attrib["filename"] == recording
    plugin = file.find("plugin[@ID='DataLoad MCAP']/parameters")
    assert plugin is not None
    names = [curve.attrib["name"] for plot in plots for curve in plot.findall("curve")]
    topics = {name.split("/")[0] for name in names}
    assert set(plugin.attrib["selected_topics"].split(";")) == topics
    return names


def test_every_name_in_the_layouts_of_a_recording_is_in_a_real_one(run: Run) -> None:
    recording = run.folder.transmitter
    values = foxglove_values((LAYOUTS / "transmitter.foxglove.json").read_text())
    names = plotjuggler_names((LAYOUTS / "transmitter.plotjuggler.xml").read_text(), "transmitter.mcap")
    assert len(values) == len(names) > 8
    for pattern, texts in ((FOXGLOVE_PATH, values), (PLOTJUGGLER_NAME, names)):
        for text in texts:
            match = pattern.fullmatch(text)
            assert match is not None, text
            assert_is_recorded(recording, *match.groups())


def test_every_name_in_the_layouts_of_a_converted_run_is_in_it(run: Run, tmp_path: Path) -> None:
    recording, foxglove, juggler = convert(run, "mcap", tmp_path / "flight.mcap")
    values = foxglove_values(foxglove.read_text())
    names = plotjuggler_names(juggler.read_text(), "flight.mcap")
    assert "flight.reference_rad" in values
    assert "flight/symbol" in names
    for pattern, texts in ((FOXGLOVE_PATH, values), (PLOTJUGGLER_NAME, names)):
        for text in texts:
            match = pattern.fullmatch(text)
            assert match is not None, text
            assert_is_recorded(recording, *match.groups())


@pytest.mark.parametrize("which", [0, 1])
def test_when_a_layout_exists_then_nothing_is_written_without_an_order(
    run: Run, tmp_path: Path, which: int
) -> None:
    target = tmp_path / "flight.mcap"
    own = layout_paths(target)[which]
    own.write_text("my own plots")
    with pytest.raises(RecordingError, match=rf"{own.name} exists already.*--force"):
        convert(run, "mcap", target)
    assert [path.name for path in tmp_path.iterdir()] == [own.name]
    assert own.read_text() == "my own plots"
    assert own in convert(run, "mcap", target, overwrite=True)
    assert "flight" in own.read_text()


def test_when_a_layout_cannot_be_written_then_it_is_reported(run: Run, tmp_path: Path) -> None:
    target = tmp_path / "flight.mcap"
    layout_paths(target)[0].mkdir()
    with pytest.raises(WriteError, match="cannot be written"):
        convert(run, "mcap", target, overwrite=True)
