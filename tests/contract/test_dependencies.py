"""What Rumo depends on: bounded, with known licences; nothing in continuous integration changes by itself."""

import re
import tomllib
from importlib.metadata import files, metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = [name for extra, names in PROJECT["optional-dependencies"].items() if extra != "dev" for name in names]
DEPENDENCIES = PROJECT["dependencies"] + EXTRAS
NAMES = [re.match(r"[\w.-]+", dependency).group() for dependency in DEPENDENCIES]


def listed():
    """Licences on the page, by distribution."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = page.split("### Their licences")[1].split("\n## ")[0]
    return dict(re.findall(r"^\| `([\w-]+)` \| (.+) \|$", section, re.MULTILINE))


@pytest.mark.parametrize("dependency", DEPENDENCIES)
def test_a_dependency_has_bounds_on_both_sides(dependency):
    assert re.fullmatch(r"[\w-]+>=[\d.]+,<\d+", dependency)


def test_the_licences_of_all_dependencies_are_listed():
    assert list(listed()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_licence_is_what_the_package_says(name):
    said = metadata(name)
    words = " ".join([said.get("License-Expression") or "", said.get("License") or "", *said.get_all("Classifier", [])])
    if not words.strip():  # it says so in a file alone
        texts = [file for file in files(name) or () if ".dist-info" in str(file) and "LICENSE" in file.name]
        words = " ".join(file.read_text(encoding="utf-8") for file in texts)
    kinds = {
        "BSD": "BSD|Redistribution and use in source and binary forms, with or without",
        "LGPL": "LGPL|Lesser",
        "PSF": "PSF|Python Software Foundation",
    }
    (kind,) = re.findall("^BSD|^MIT|^Apache|^LGPL|PSF", listed()[name])
    kind = kinds.get(kind, kind)
    assert re.search(kind, words)


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "workflows").glob("*.yml")), ids=lambda path: path.name)
def test_workflows_use_commits_and_may_only_read(path):
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"uses: (.*)", text)
    assert used
    for action in used:
        assert re.fullmatch(r"[\w/-]+@[0-9a-f]{40} # v[\d.]+", action)
    assert re.findall(r"^permissions:\n((?:  .*\n)+)", text, re.MULTILINE) == ["  contents: read\n"]
