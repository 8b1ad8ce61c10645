"""The import rule: a room imports only from rooms before it and from the leaves, and modules not in circles."""

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import rumo

SOURCE = Path(rumo.__file__).parent
LEAVES = [
    "version",
    "errors",
    "checks",
    "status",
    "signals",
    "sealed",
    "files",
    "forks",
    "interrupts",
    "expressions",
    "extras",
    "graphs",
    "locks",
    "turns",
]
ROOMS = [
    "model",
    "actuation",
    "discretization",
    "grid",
    "terms",
    "structure",
    "numbers",
    "draft",
    "measurements",
    "problem",
    "kernel",
    "influence",
    "transcription",
    "shift",
    "nominal",
    "recording",
    "plan",
    "analysis",
    "controllers",
    "estimation",
    "vehicles",
    "textbook",
    "references",
    "registry",
    "simulation",
    "report",
    "environment",
    "studies",
    "scenarios",
    "campaigns",
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


def module_of(path):
    return ".".join(("rumo", *path.relative_to(SOURCE).with_suffix("").parts)).removesuffix(".__init__")


FILES = {module_of(path): path for path in SOURCE.rglob("*.py")}


class Imports(ast.NodeVisitor):
    """All (module, name) that a file imports, wherever in it; but not those for type checkers alone."""

    def __init__(self, path):
        self.found = []
        self.visit(ast.parse(path.read_text()))

    def visit_If(self, node):
        body = [] if ast.unparse(node.test) == "TYPE_CHECKING" else node.body
        for statement in (*body, *node.orelse):
            self.visit(statement)

    def visit_Import(self, node):
        self.found += [(alias.name, "") for alias in node.names]

    def visit_ImportFrom(self, node):
        self.found += [(node.module, alias.name) for alias in node.names]


def origin(importer, module, name, imports):
    """Which module a name comes from: for those outside a package, not the `__init__` that hands it on."""
    if f"{module}.{name}" in FILES:
        return f"{module}.{name}"
    if module in FILES and FILES[module].stem == "__init__" and not f"{importer}.".startswith(f"{module}."):
        inner = next((inner for inner, handed_on in imports[module] if handed_on == name), None)
        return module if inner is None else origin(module, inner, name, imports)
    return module


def test_no_module_imports_itself_by_way_of_others():
    imports = {name: Imports(path).found for name, path in FILES.items()}
    graph = {
        importer: {origin(importer, module, name, imports) for module, name in found} & FILES.keys()
        for importer, found in imports.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail("a circle: " + ", imported by ".join(error.args[1]))


def test_a_controller_alone_loads_little():
    heavy = ("scipy", "xarray", "matplotlib", "plotly", "rumo.simulation", "rumo.report", "rumo.cli")
    code = f"import sys, rumo; rumo.RealTimeIteration; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_every_public_name_is_there():
    for name in rumo.__all__:
        assert getattr(rumo, name) is not None


def test_modules_are_there_without_further_imports():
    code = "import rumo; rumo.interrupts.interruptible, rumo.simulation.save, rumo.vehicles.PAPER_CAR"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stderr == ""
    assert {"RealTimeIteration", "simulation", "vehicles"} <= set(dir(rumo))
    with pytest.raises(AttributeError, match="no attribute 'simulatoin'"):
        rumo.simulatoin  # noqa: B018
