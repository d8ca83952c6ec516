"""A new kind of link, coder, model, plant or controller: one module and one line, here or elsewhere."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from channel.links.registry import LINKS, link_kind
from channel.registry import Registry, RegistryError
from tenbaud.config.kinds import CODERS
from tests.rules.sources import PACKAGES, TOP
from tests.tenbaud.new_parts import CHOSEN, NEW_PARTS
from tests.tenbaud.processes import Ended, run


def options(settings: dict[str, object]) -> list[str]:
    return [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]


def fly(path: Path, cwd: Path, settings: dict[str, object]) -> Ended:
    """Fly over every new part, with `path` before everything else that Python looks into."""
    search = os.pathsep.join([str(path), str(TOP)])
    common = ["--json", "--duration", "10", "--out", "run", "--mismatch", "0"]
    environment = {"PYTHONPATH": search}
    return run("demo", *common, *options(settings), cwd=cwd, environment=environment)


def assert_flown(ended: Ended) -> None:
    assert ended.code == 0, ended.err
    summary = ended.summary
    assert summary["link"] == "datagrams"
    assert summary["plant"] == "cart"
    assert summary["digest_checks"] == summary["samples"] == 100
    assert summary["desyncs"] == 0
    assert summary["coder_bits_up"] == 100


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the project with the new modules and lines in it, as the working folder."""
    for package in PACKAGES:
        shutil.copytree(TOP / package, tmp_path / package)  # what is compiled of it too
    for name, part in NEW_PARTS.items():
        (tmp_path / f"{part.module.replace('.', '/')}.py").write_text(part.source)
        registry = tmp_path / part.registry
        text = registry.read_text()
        assert text.count(part.line_above) == 1
        line = f'{part.line_above},\n        "{name}": "{part.module}:{part.attribute}"'
        registry.write_text(text.replace(part.line_above, line))
    return tmp_path


def test_when_each_part_gets_a_module_and_a_line_then_they_fly_with_options_of_their_own(
    tree: Path,
) -> None:
    own = {"coder.step_rad": 0.03, "model.friction": 0.6, "transmitter.plant.options.friction": 0.6}
    assert_flown(fly(tree, tree, {**CHOSEN, **own}))
    assert 'kind = "steps"\nstep_rad = 0.03' in (tree / "run" / "config.toml").read_text()
    refused = fly(tree, tree, {**CHOSEN, "coder.stp_rad": 0.03, "coder.step_rad": "far"})
    assert refused.code != 0
    assert "coder.stp_rad: unknown field; did you mean step_rad?" in refused.err
    assert "coder.step_rad = 'far'" in refused.err


def install(folder: Path, package: str, offers: dict[str, dict[str, str]]) -> None:
    """Put what an installed distribution leaves into a folder: its metadata and its entry points."""
    metadata = folder / f"{package}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    groups = [
        "\n".join([f"[{group}]", *(f"{name} = {value}" for name, value in names.items())])
        for group, names in offers.items()
    ]
    (metadata / "entry_points.txt").write_text("\n\n".join(groups) + "\n")


def test_when_an_installed_package_offers_them_then_they_fly_by_name(tmp_path: Path) -> None:
    site = tmp_path / "site"
    offers = {}
    for name, part in NEW_PARTS.items():
        module = f"offered_{name}"
        offers[part.group] = {name: f"{module}:{part.attribute}"}
        site.mkdir(exist_ok=True)
        (site / f"{module}.py").write_text(part.source)
    install(site, "offered-parts", offers)
    assert_flown(fly(site, tmp_path, {**CHOSEN, "coder.options.step_rad": 0.03}))
    environment = {"PYTHONPATH": os.pathsep.join([str(site), str(TOP)])}
    refused = run("audit", "run", cwd=tmp_path, environment=environment)
    assert refused.code != 0
    assert "the package offered-parts offers as offered_steps:Steps" in refused.err
    audited = run("audit", "run", "--allow-code", cwd=tmp_path, environment=environment)
    assert audited.code == 0, audited.out + audited.err


def test_when_an_offered_link_cannot_be_loaded_then_its_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken_carrier.py").write_text("import a_library_that_nobody_has\n")
    (tmp_path / "odd_carrier.py").write_text("class Odd:\n    pass\n")
    offers = {"carrier": "broken_carrier:Kind", "odd": "odd_carrier:Odd", "zenoh": "odd_carrier:Odd"}
    install(tmp_path, "carrier-pigeons", {LINKS.group: offers})
    install(tmp_path, "other-pigeons", {LINKS.group: {"odd": "elsewhere:Odd"}})
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(RegistryError, match=r"package carrier-pigeons .*a_library_that_nobody_has"):
        link_kind("carrier")
    with pytest.raises(
        RegistryError, match=r"carrier-pigeons and the package other-pigeons both offer"
    ):
        link_kind("odd")
    shutil.rmtree(tmp_path / "other-pigeons-1.0.dist-info")
    with pytest.raises(RegistryError, match=r"link\.kind = 'odd': .*Odd.*LinkKind"):
        link_kind("odd")
    # What is built in cannot be replaced.
    assert type(link_kind("zenoh")).__name__ == "ZenohKind"


@pytest.mark.parametrize(
    ("registry", "name", "words"),
    [
        (LINKS, "zenho", r"known are zenoh, serial, memory; did you mean zenoh\?"),
        (CODERS, "zom", r"known are zoom, .* and module:Class; did you mean zoom\?"),
        (LINKS, "quite other", "known are zenoh, serial, memory$"),
    ],
)
def test_when_nobody_offers_a_name_then_the_nearest_is_named(
    registry: Registry, name: str, words: str
) -> None:
    with pytest.raises(RegistryError, match=words):
        registry.load(name)
