"""The import rule: a room imports only from rooms before it and from the leaves."""

import ast
import subprocess
import sys
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
NAMES = {path: ".".join(("rumo", *path.with_suffix("").parts)).removesuffix(".__init__") for path in MODULES}


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
    """What a module loads when it is imported: of a package, a module of it or the package itself."""
    for node in ast.parse((SOURCE / path).read_text()).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in NAMES.values() else node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_no_modules_import_each_other():
    waiting = {name: set(imported_modules(path)) & set(NAMES.values()) - {name} for path, name in NAMES.items()}
    while free := {name for name, imports in waiting.items() if not imports & waiting.keys()}:
        waiting = {name: imports for name, imports in waiting.items() if name not in free}
    assert not waiting


def test_a_controller_alone_loads_little():
    heavy = ("scipy", "xarray", "matplotlib", "plotly", "rumo.simulation", "rumo.report", "rumo.cli")
    code = f"import sys, rumo; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_every_public_name_is_there():
    for name in rumo.__all__:
        assert getattr(rumo, name) is not None
