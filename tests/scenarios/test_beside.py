"""What a file of the user's imports from beside itself: part of what decides a run, and found whenever it is needed."""

import os
import subprocess
import sys

import pytest

from rumo.scenarios import Recipe
from rumo.scenarios.beside import modules_beside

OWN = """
import json
import beside
from parts.speeds import SLOW
from rumo.scenarios import Recipe

class Own:
    def __init__(self, value):
        self.value = value

    def run(self):
        import late
        return self.value + late.MORE

def make(*, controller="rti"):
    from parts import fast
    return Own(beside.SPEED + SLOW + fast.SPEED)
"""
FILES = {
    "beside.py": "SPEED = 100\n",
    "late.py": "def more():\n    import later\n    return later.MORE\n\nMORE = more()\n",
    "later.py": "MORE = 0.5\n",
    "parts/__init__.py": "",
    "parts/speeds.py": "from .slow import SLOW\n",
    "parts/slow.py": "SLOW = 20\n",
    "parts/fast.py": "SPEED = 3\n",
    "json.py": "raise RuntimeError\n",
    "nobody.py": "1 / 0\n",
    "broken.py": "def\n",
}


def folder_with(place, **changed):
    for name, text in {"own.py": OWN, **FILES, **{f"{name}.py": text for name, text in changed.items()}}.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
    return place / "own.py"


def driven(own):
    return Recipe(f"{own}:make").run().run()


@pytest.fixture
def own(tmp_path):
    return folder_with(tmp_path / "one")


def test_modules_are_those_that_are_imported_from_beside_it(own):
    names = ["beside", "late", "later", "parts", "parts.fast", "parts.slow", "parts.speeds"]
    assert list(modules_beside(own)) == names
    own.write_text('from importlib import import_module\nimport broken, numpy\nimport_module("nobody")\n')
    assert list(modules_beside(own)) == ["broken", "nobody"]
    installed = folder_with(own.parent / "site-packages")
    assert modules_beside(installed) == {}


@pytest.mark.parametrize(
    ("listed", "also"),
    [
        ("__all__ = ['slow']\n__all__ += ('no_module',)", ["slow"]),
        ("__all__ = [name for name in ('fast',)]", ["fast", "slow", "speeds"]),
        ("from os import __all__", ["fast", "slow", "speeds"]),
        ("slow = 1", []),
    ],
)
def test_of_a_whole_package_there_is_what_it_lists(own, listed, also):
    own.write_text("from parts import *\n")
    (own.parent / "parts" / "__init__.py").write_text(listed)
    assert list(modules_beside(own)) == ["parts", *(f"parts.{name}" for name in also)]


@pytest.mark.parametrize(
    "told", ["'.fast', __package__", "'.fast', package='parts'", "name='..fast', package='parts.slow'"]
)
def test_a_relative_name_that_is_told_is_found(own, told):
    own.write_text("import parts\n")
    (own.parent / "parts" / "__init__.py").write_text(f"import importlib\nimportlib.import_module({told})\n")
    assert list(modules_beside(own)) == ["parts", "parts.fast"]


@pytest.mark.parametrize("name", ["beside", "late", "later", "parts/__init__", "parts/slow", "parts/fast"])
def test_what_is_in_them_is_part_of_a_runs_identity(own, name):
    before = Recipe(f"{own}:make").identity
    assert str(own.parent) not in str(before)
    (own.parent / f"{name}.py").write_text(FILES[f"{name}.py"] + "# other\n")
    assert Recipe(f"{own}:make").identity != before


def test_what_nothing_imports_is_not(own):
    before = Recipe(f"{own}:make").identity
    for name in ("nobody", "json"):
        (own.parent / f"{name}.py").write_text("other = 1\n")
    assert Recipe(f"{own}:make").identity == before


def test_they_are_found_while_a_run_is_made(own):
    assert driven(own) == 123.5
    told = f"from rumo.scenarios import Recipe; print(Recipe('{own}:make').run().run())"
    assert subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True).stdout == "123.5\n"


def test_files_of_two_folders_keep_apart_what_has_the_same_name(own, tmp_path):
    other = folder_with(tmp_path / "two", beside="SPEED = 200\n", later="MORE = 0.25\n")
    first = Recipe(f"{own}:make").run()
    assert driven(other) == 223.25
    assert [driven(own), driven(other), Recipe(f"{own}:make").run().run()] == [123.5, 223.25, 123.5]
    assert first.value == 123


def test_what_has_changed_is_loaded_anew(own):
    assert driven(own) == 123.5
    (own.parent / "later.py").write_text("MORE = 0.75\n")
    (own.parent / "parts" / "slow.py").write_text("SLOW = 40\n")
    assert driven(own) == 143.75


@pytest.mark.parametrize(
    ("name", "old", "new", "value"),
    [("own", "+ SLOW", "- SLOW", 83.5), ("beside", "100", "109", 132.5), ("parts/slow", "20", "29", 132.5)],
)
def test_what_runs_is_what_is_in_a_file_whatever_was_compiled(own, monkeypatch, name, old, new, value):
    """Of the same size and time, as those of an archive, a file is another one if it holds something else."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    own.write_text(f"{OWN}# {name}: one that is not loaded yet\n")
    file = own.parent / f"{name}.py"
    written, status = file.read_text(), file.stat()
    assert driven(own) == 123.5
    before = Recipe(f"{own}:make").identity
    file.write_text(written.replace(old, new))
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert file.stat().st_size == status.st_size
    assert Recipe(f"{own}:make").identity != before
    assert driven(own) == value
