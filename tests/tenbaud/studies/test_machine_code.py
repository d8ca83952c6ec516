"""Where machine code is kept, which sources and settings it stands for, and who compiles."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
import pytest

from channel.codec.numerics import sin
from tenbaud.studies import linked, machine_code
from tenbaud.studies.compiled import compiled, named
from tenbaud.studies.machine_code import (
    BESIDE,
    KEPT_FOLDERS,
    KEPT_S,
    SETTINGS,
    figure_sources,
    make_ready,
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
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)
    hits = []
    for folder in ("here", "elsewhere", "elsewhere, on another line"):
        lines = "\n" * folder.count(",")
        scope: dict[str, Any] = {}
        exec(
            compile(f"{lines}def doubled(x):\n    return x + x\n", f"/{folder}/part.py", "exec"), scope
        )
        doubled = named(scope["doubled"], "doubled", inner=False)
        assert doubled(1.5) == 3.0
        hits.append(sum(doubled.stats.cache_hits.values()))
    assert hits == [0, 1, 0]


@pytest.mark.filterwarnings("ignore:.*Could not find source")
@pytest.mark.parametrize("setting", SETTINGS)
def test_machine_code_of_other_settings_is_another(
    setting: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)
    usual = getattr(numba.config, setting)
    hits = []
    # Without any optimisation numba keeps nothing.
    for value in (usual, usual, 0 if usual == 1 else 1, usual):
        monkeypatch.setattr(numba.config, setting, type(usual)(value) if usual is not None else value)
        scope: dict[str, Any] = {"__name__": "channel.codec.lead"}
        exec(compile("def halved(x):\n    return 0.5 * x\n", "part.py", "exec"), scope)
        halved = named(scope["halved"], "halved", inner=False)
        assert halved(3.0) == 1.5
        hits.append(sum(halved.stats.cache_hits.values()))
    assert hits == [0, 1, 0, 1]


COMPILE = """
import sys
from channel.codec.numerics import sin
from tenbaud.studies.compiled import compiled
from tenbaud.studies.machine_code import make_ready
sys.stdin.readline()
made = compiled(sin)
make_ready(made, 0.5)
print(sum(made.stats.cache_hits.values()), made(0.5).hex(), flush=True)
"""


def test_when_two_processes_need_a_function_at_once_then_one_compiles_it(tmp_path: Path) -> None:
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", COMPILE]
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with (
        subprocess.Popen(command, cwd=TOP, env=environment, **pipes) as one,
        subprocess.Popen(command, cwd=TOP, env=environment, **pipes) as other,
    ):
        for process in (one, other):
            process.stdin.write("\n")
            process.stdin.flush()
        said = sorted(process.communicate()[0] for process in (one, other))
    assert said == [f"{hits} {sin(0.5).hex()}\n" for hits in (0, 1)]


def test_when_there_is_no_place_for_machine_code_then_it_is_compiled_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(machine_code, "cache_folder", lambda: None)
    scope: dict[str, Any] = {"__name__": "channel.codec.lead"}
    exec(compile("def tripled(x):\n    return 3.0 * x\n", "part.py", "exec"), scope)
    tripled = named(scope["tripled"], "tripled", inner=False)
    make_ready(tripled, 1.5)
    assert len(tripled.signatures) == 1
    assert tripled(1.5) == 4.5


@pytest.mark.parametrize("versions", [linked.TRIED, ()], ids=["tried", "another"])
def test_a_part_is_linked_alone_where_numba_is_known_and_no_bit_differs(
    versions: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if versions and not numba.__version__.startswith(versions):
        pytest.skip(f"parts are compiled as any function by numba {numba.__version__}")
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(linked, "TRIED", versions)
    remembered = (compiled, linked.part_compiler)
    try:
        for kept in (False, True):
            for one in remembered:
                one.cache_clear()
            made = compiled(sin)
            for x in (-3.0, 0.7, 40.0):
                assert made(x).hex() == sin(x).hex()
            with pytest.raises(ValueError, match="out of range"):
                made(2e5)
            assert sum(made.stats.cache_hits.values()) == kept
            if not kept:
                (result,) = made.py_func.__globals__["_reduce_angle"].overloads.values()
                linked_alone = result.library.get_pointer_to_function(result.fndesc.llvm_func_name) == 0
                assert linked_alone == bool(versions)
    finally:
        for one in remembered:
            one.cache_clear()


@pytest.mark.parametrize("module", ["channel.codec.lead", "a_plug_in"])
def test_machine_code_is_kept_for_the_sources_that_its_folder_stands_for_alone(
    module: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)
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
    machine_code.cache_folder.cache_clear()
    folder = machine_code.cache_folder()
    assert folder is not None
    os.utime(folder, (0.0, 0.0))
    machine_code.cache_folder.cache_clear()
    assert machine_code.cache_folder() == folder
    assert folder.stat().st_mtime > time.time() - 60.0
    machine_code.cache_folder.cache_clear()
