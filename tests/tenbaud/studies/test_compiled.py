"""Which sources stand for the figures of a flight."""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from tenbaud.studies import compiled as compiling
from tenbaud.studies.compiled import (
    BESIDE,
    KEPT_FOLDERS,
    KEPT_S,
    compiled,
    figure_sources,
    named,
    prune,
)
from tests.rules.sources import TOP


def test_whatever_turns_a_configuration_into_a_flight_is_among_the_sources() -> None:
    found = figure_sources()
    for name in (
        "channel/codec/coders/zoom.py",
        "tenbaud/build/codec.py",
        "tenbaud/config/schema.py",
        "tenbaud/flight/transmit.py",
        "tenbaud/studies/kernel.py",
        "transmitter/metrics/scores.py",
    ):
        assert TOP / name in found, f"results would outlive a change of {name}"
    assert len(found) == len(set(found))


def test_what_is_left_out_is_there_and_only_draws_or_keeps_results() -> None:
    for name in BESIDE:
        assert (TOP / name).is_file()
        assert TOP / name not in figure_sources()


def test_machine_code_is_found_again_wherever_the_sources_lie(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    hits = []
    for folder in ("here", "elsewhere", "elsewhere, on another line"):
        lines = "\n" * folder.count(",")
        scope: dict[str, Any] = {}
        exec(
            compile(f"{lines}def doubled(x):\n    return x + x\n", f"/{folder}/part.py", "exec"), scope
        )
        doubled = named(scope["doubled"], "doubled")
        assert doubled(1.5) == 3.0
        hits.append(sum(doubled.stats.cache_hits.values()))
    assert hits == [0, 1, 0]


@pytest.mark.parametrize("module", ["channel.codec.lead", "a_plug_in"])
def test_machine_code_is_kept_for_the_sources_that_its_folder_stands_for_alone(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "_cache_folder", lambda: tmp_path)
    scope: dict[str, Any] = {"__name__": module}
    exec(compile("def tripled(x):\n    return 3.0 * x\n", "part.py", "exec"), scope)
    exec(compile("def outer(x):\n    return inner(x)\n", "part.py", "exec"), scope)
    inner = compiled(scope["tripled"])
    assert inner(1.5) == 4.5
    scope["__name__"] = "tenbaud.studies.kernel"
    outer = FunctionType(scope["outer"].__code__, scope | {"inner": None}, "outer")
    assert compiled(outer, (("inner", inner),))(1.5) == 4.5
    assert any(tmp_path.iterdir()) == (module != "a_plug_in")


def test_machine_code_of_old_sources_goes_but_for_the_last_few(tmp_path: Path) -> None:
    for age in range(2 * KEPT_FOLDERS):
        (tmp_path / f"{age:02}").mkdir()
        (tmp_path / f"{age:02}" / "code.nbi").touch()
        # All were used a moment ago, but for the last three.
        used = time.time() - age - (2.0 * KEPT_S if age >= 2 * KEPT_FOLDERS - 3 else 0.0)
        os.utime(tmp_path / f"{age:02}", (used, used))
    prune(tmp_path)
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        f"{age:02}" for age in range(2 * KEPT_FOLDERS - 3)
    ]
    long_ago = time.time() - 2.0 * KEPT_S
    for folder in tmp_path.iterdir():
        os.utime(folder, (long_ago, long_ago))
    prune(tmp_path)
    assert len(list(tmp_path.iterdir())) == KEPT_FOLDERS


def test_machine_code_that_is_used_counts_as_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compiling._cache_folder.cache_clear()
    folder = compiling._cache_folder()
    assert folder is not None
    os.utime(folder, (0.0, 0.0))
    compiling._cache_folder.cache_clear()
    assert compiling._cache_folder() == folder
    assert folder.stat().st_mtime > time.time() - 60.0
    compiling._cache_folder.cache_clear()
