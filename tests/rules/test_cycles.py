"""No two files and no two folders need each other, imports inside functions included."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter

import pytest

from tests.rules.sources import OUTSIDE, PACKAGES, files_below
from tests.rules.test_imports import imports_of


def module_of(name: str) -> str:
    """Return the dotted module of a file such as `channel/codec/codec.py`."""
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def needs(texts: Iterable[tuple[str, str]]) -> dict[str, set[str]]:
    """Return for each module of ours the modules of ours that it imports."""
    sources = {module_of(name): (name, source) for name, source in texts}
    graph: dict[str, set[str]] = {module: set() for module in sources}
    for module, (name, source) in sources.items():
        for _, imported, _ in imports_of(source, name):
            # `from a.b import c` is of the module a.b.c where there is one, else of a.b.
            target = imported if imported in sources else imported.rpartition(".")[0]
            if target in sources and target != module:
                graph[module].add(target)
    return graph


def folders(graph: Mapping[str, set[str]], packages: set[str]) -> dict[str, set[str]]:
    """Return the same graph of folders; `packages` are the modules that are folders themselves."""

    def folder(module: str) -> str:
        return module if module in packages else module.rpartition(".")[0]

    found: dict[str, set[str]] = {}
    for module, targets in graph.items():
        own = folder(module)
        found.setdefault(own, set()).update({folder(one) for one in targets} - {own})
    return found


def cycle_in(graph: Mapping[str, set[str]]) -> list[str]:
    """Return one cycle, its first member again at the end; empty without any."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))
    return []


def test_files_and_folders_have_no_cycles() -> None:
    texts = list(files_below(*PACKAGES, *OUTSIDE))
    graph = needs(texts)
    packages = {module_of(name) for name, _ in texts if name.endswith("/__init__.py")}
    assert cycle_in(graph) == []
    assert cycle_in(folders(graph, packages)) == []


@pytest.mark.parametrize(
    "text",
    ["import a.second", "def f():\n    from a import second", "def f():\n    from a.second import x"],
)
def test_a_cycle_of_files_is_caught(text: str) -> None:
    graph = needs([("a/first.py", text), ("a/second.py", "from a.first import y")])
    assert set(cycle_in(graph)) == {"a.first", "a.second"}


def test_a_cycle_of_folders_is_caught() -> None:
    texts = [
        ("a/one.py", "import b.one"),
        ("b/one.py", ""),
        ("b/two.py", "import a.two"),
        ("a/two.py", ""),
    ]
    graph = needs(texts)
    assert cycle_in(graph) == []
    assert set(cycle_in(folders(graph, set()))) == {"a", "b"}
