"""The import rule: a room imports only from rooms before it and from the leaves."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import rumo

SOURCE = Path(rumo.__file__).parent
LEAVES = ["version", "errors", "checks", "status", "signals", "sealed", "files", "interrupts", "expressions"]
ROOMS = [
    "model",
    "grid",
    "terms",
    "structure",
    "numbers",
    "draft",
    "problem",
    "discretization",
    "kernel",
    "transcription",
    "shift",
    "recording",
    "plan",
    "controllers",
    "estimation",
    "vehicles",
    "textbook",
    "references",
    "registry",
    "simulation",
    "report",
    "studies",
    "bench",
    "cli",
]
MODULES = [
    path.relative_to(SOURCE) for path in sorted(SOURCE.rglob("*.py")) if path.parent != SOURCE or path.stem[0] != "_"
]


def room(path):
    return path.parts[0].removesuffix(".py")


def imported_rooms(path):
    for node in ast.walk(ast.parse((SOURCE / path).read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "rumo":
            yield from [node.module.split(".")[1]] if "." in node.module else (alias.name for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name.split(".")[1] for alias in node.names if alias.name.startswith("rumo."))


def test_every_module_is_in_a_room():
    assert {room(path) for path in MODULES} == {*LEAVES, *ROOMS}


@pytest.mark.parametrize("path", MODULES, ids=str)
def test_imports_point_backwards(path):
    own = room(path)
    order = LEAVES + ROOMS
    for other in imported_rooms(path):
        allowed = LEAVES if own in LEAVES else order[: order.index(own) + 1]
        assert other in allowed, f"{path} imports from {other}"


def imported_modules(path):
    """Modules of Rumo that a file imports anywhere, also for the type checker or in a function."""
    for node in ast.walk(ast.parse((SOURCE / path).read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "rumo":
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from [name if module_file(name) in MODULES else node.module for name in names]


def module_file(name):
    return Path(*name.split(".")[1:]).with_suffix(".py")


@pytest.mark.parametrize("chosen", ["report", "studies", "bench", "cli"])
def test_no_module_is_imported_by_what_it_imports(chosen):
    files = [path for path in MODULES if room(path) == chosen and path.stem != "__init__"]
    graph = {path: {module_file(name) for name in imported_modules(path)} & {*files} for path in files}
    TopologicalSorter(graph).prepare()  # raises with the circle


def test_a_controller_alone_loads_little():
    heavy = ("scipy", "xarray", "matplotlib", "plotly", "rumo.simulation", "rumo.report", "rumo.cli")
    code = f"import sys, rumo; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_every_public_name_is_there():
    for name in rumo.__all__:
        assert getattr(rumo, name) is not None
