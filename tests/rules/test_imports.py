"""Imports point one way, and the two transports stay behind their adapters."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from fnmatch import fnmatchcase

import pytest

from tests.rules.sources import OUTSIDE, PACKAGES, files_below, report

MAY_IMPORT = {
    "channel": {"channel"},
    "plant_sim": {"plant_sim"},
    "transmitter": {"transmitter", "channel", "plant_sim"},
    "receiver": {"receiver", "channel"},
    "tenbaud": set(PACKAGES),
    "reproduction": {*PACKAGES, *OUTSIDE},
}
"""For each package, the packages of this project that it may import."""

NEVER = {"tests", "benchmarks"}
"""These are not in the wheel, so nothing that is may need them."""

ONLY_IN = {
    "zenoh": ("channel/links/zenoh/*.py",),
    "serial": ("channel/links/serial/*.py", "transmitter/rigs/*.py"),
}
"""A transport is replaceable as long as only its adapter knows it."""

LAZY = ("zenoh", "channel.links.zenoh.link")
"""Imported inside functions only, except by the adapter: a memory or serial flight needs no Zenoh,
and loading it takes time and starts threads."""

COMMANDS_OF_A_CHECKOUT = ("tenbaud/cli/checkout.py",)
"""It adds the commands of `reproduction`, which an installed tenbaud lacks."""

WITHOUT_ARRAYS = ("channel/*", "receiver/*")
"""What must agree to the last bit, or run every tick, does without numpy and scipy."""

HEAVY = ("control", "matio", "matplotlib", "pandas")
"""Tests import them inside functions: each worker imports what stands at the top of any file."""

ARRAYS = ("channel/flight_log.py",)
"""A recorded flight is data from before the flight."""


def imports_of(source: str, name: str) -> Iterator[tuple[int, str, bool]]:
    """Yield (line, dotted module, at module level) of every import, the literal dynamic too.

    An import below ``if TYPE_CHECKING`` counts as one inside a function: it never runs.
    """
    package = name.removesuffix(".py").split("/")[:-1]

    def visit(node: ast.AST, top: bool) -> Iterator[tuple[int, str, bool]]:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, top
        elif isinstance(node, ast.ImportFrom):
            stem = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*stem, *([node.module] if node.module else [])])
            for alias in node.names:
                yield node.lineno, f"{base}.{alias.name}", top
        elif isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            if called.split(".")[-1] in ("import_module", "__import__") and node.args:
                argument = node.args[0]
                if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                    yield node.lineno, argument.value, top
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            top = False
        guarded = isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
        for child in ast.iter_child_nodes(node):
            yield from visit(child, top and not guarded)

    yield from visit(ast.parse(source, filename=name), True)


def is_within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def findings_in(source: str, name: str) -> list[str]:
    """Return one line for each import that breaks a rule."""
    own = name.split("/")[0]
    found = []
    for line, module, at_module_level in imports_of(source, name):
        root = module.split(".")[0]
        where = f"{name}:{line}: imports {module}: "
        if root in NEVER:
            found.append(where + "it is not in the wheel")
        outside = root in OUTSIDE and name not in COMMANDS_OF_A_CHECKOUT
        if (root in PACKAGES or outside) and root not in MAY_IMPORT[own]:
            found.append(where + f"{own} may import only {sorted(MAY_IMPORT[own])}")
        homes = ONLY_IN.get(root, ("*",))
        if not any(fnmatchcase(name, home) for home in homes):
            found.append(where + f"only {', '.join(homes)} may")
        is_adapter = any(fnmatchcase(name, home) for home in ONLY_IN["zenoh"])
        if at_module_level and not is_adapter and any(is_within(module, lazy) for lazy in LAZY):
            found.append(where + "inside a function only, so that it loads when it is used")
        without = name not in ARRAYS and any(fnmatchcase(name, one) for one in WITHOUT_ARRAYS)
        if root in ("numpy", "scipy") and without:
            found.append(where + "this module does without arrays")
    return found


def test_every_import_of_the_packages_keeps_the_rules() -> None:
    texts = files_below(*PACKAGES, *OUTSIDE)
    found = [line for name, source in texts for line in findings_in(source, name)]
    assert not found, report(found)


def test_what_only_some_tests_need_is_not_imported_to_collect_all() -> None:
    found = [
        f"{name}:{line}: imports {module} at the top"
        for name, source in files_below("tests")
        for line, module, at_module_level in imports_of(source, name)
        if at_module_level and module.split(".")[0] in HEAVY
    ]
    assert not found, report(found)


def test_every_package_is_there() -> None:
    assert {name.split("/")[0] for name, _ in files_below(*PACKAGES)} == set(PACKAGES)


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("channel/codec/codec.py", "import transmitter.session.session"),
        ("channel/codec/codec.py", "from plant_sim import pitch"),
        ("channel/codec/codec.py", "def f():\n    import tenbaud"),
        ("channel/codec/codec.py", "import numpy as np"),
        ("channel/links/kind.py", "from scipy.linalg import expm"),
        ("channel/links/kind.py", "def f():\n    import zenoh"),
        ("channel/links/kind.py", "from .zenoh import link"),
        ("channel/links/kind.py", "import serial.tools"),
        ("plant_sim/pitch.py", "from channel.codec.numerics import sin"),
        ("plant_sim/pitch.py", "import tests.golden"),
        ("transmitter/session/session.py", "from receiver import session"),
        (
            "transmitter/session/session.py",
            "import importlib\nimportlib.import_module('receiver.loop')",
        ),
        ("transmitter/rigs/quarc.py", "from ...tenbaud import config"),
        ("transmitter/loop.py", "import serial"),
        ("transmitter/loop.py", "from channel.links.zenoh import link"),
        ("receiver/session/session.py", "import plant_sim"),
        ("receiver/session/session.py", "import numpy"),
        ("receiver/loops/real.py", "if True:\n    import numpy"),
        ("receiver/controllers/pid.py", "from numpy import clip"),
        ("tenbaud/cli.py", "from channel.links.zenoh.link import ZenohLink"),
        ("tenbaud/checks/doctor.py", "def f():\n    import zenoh"),
        ("tenbaud/cli/demo.py", "def f():\n    from reproduction.paper import make"),
        ("channel/codec/codec.py", "import reproduction"),
    ],
)
def test_a_bad_import_is_caught(name: str, source: str) -> None:
    assert findings_in(source, name) != []


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("channel/codec/codec.py", "import math\nfrom channel import numerics\nfrom . import lead"),
        ("channel/links/zenoh/link.py", "import zenoh\nfrom .base import Link"),
        ("channel/links/serial/link.py", "import serial"),
        ("transmitter/session/session.py", "import channel.codec.codec\nimport plant_sim"),
        ("transmitter/rigs/bridge.py", "from serial import Serial\nimport numpy"),
        ("receiver/session/session.py", "from receiver.controllers import pid"),
        ("tenbaud/cli.py", "def f():\n    from channel.links.zenoh.link import ZenohLink"),
        ("tenbaud/a.py", "if TYPE_CHECKING:\n    from channel.links.zenoh.link import ZenohLink"),
        ("tenbaud/cli.py", "import transmitter, receiver, plant_sim, numpy"),
        ("tenbaud/cli/checkout.py", "def f():\n    from reproduction.paper import make"),
        ("reproduction/paper/make.py", "import tenbaud, reproduction.paper.plan, plant_sim"),
    ],
)
def test_a_good_import_passes(name: str, source: str) -> None:
    assert findings_in(source, name) == []
