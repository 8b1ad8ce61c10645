"""Code of pages that show how to do something: it runs in the order of the page, and prints what stands below it."""

import re
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(?P<code>.*?)```(?:\n+```text\n(?P<output>.*?)```)?", re.DOTALL)


LONG = ("index", "your-own-model", "roads", "faults", "where-to-linearise", "which-discretisation")
"""Pages that drive studies, or wait for compilers."""


def run(page):
    """Run a page's code, each block with what stands before it, and compare what it prints."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    namespace = {"__name__": "page"}
    for block in BLOCK.finditer(text):
        line = text[: block.start()].count("\n") + 2
        code = compile("\n" * (line - 1) + block["code"], f"{page}.md", "exec")
        printed = StringIO()
        with redirect_stdout(printed):
            exec(code, namespace)
        assert printed.getvalue() == (block["output"] or ""), f"{page}.md, line {line}"
    assert len(namespace) > 2


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")


@pytest.mark.parametrize(
    "page",
    [
        *("your-track", "closed-loop", "other-plants", "references", "step-it-yourself", "extend-it", "logs"),
        *("vehicles", "the-estimator", "delays", "scenario-files"),
        *(pytest.param(page, marks=pytest.mark.slow) for page in LONG),
    ],
)
def test_page(page):
    run(page)


@pytest.mark.slow
def test_first_page():
    """It runs the paper's study, prints its errors, and reads its log."""
    command = [sys.executable, "-m", "rumo", "study", "paper", "--output", "out"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    page = (DOCS / "get-started.md").read_text(encoding="utf-8")
    shown = page[page.index("How it drives") : page.index("Report: out")]
    errors, shown = (
        [line.split() for line in text.splitlines() if re.search(r"error.* \d", line)] for text in (printed, shown)
    )
    assert len(errors) == 6
    assert errors == shown
    after_2s = next(words[-3:] for words in errors if words[:5] == ["RMS", "error", "after", "2", "s"])
    row = " | ".join(f"{error} m" for error in after_2s)
    assert f"| RMS error after 2 s | {row} |" in (DOCS.parent / "README.md").read_text(encoding="utf-8")
    run("get-started")


@pytest.mark.slow
def test_your_track():
    """The command drives what the page's code has written, and prints the page's table, but for the times of steps."""
    page = (DOCS / "your-track.md").read_text(encoding="utf-8")
    for block in list(BLOCK.finditer(page))[:2]:
        exec(block["code"], {"Path": Path})
    command = next(line for line in page.splitlines() if line.startswith("$ rumo drive --track")).split()[2:]
    printed = subprocess.run(
        [sys.executable, "-m", "rumo", *command], capture_output=True, text=True, check=True
    ).stdout
    shown = page[page.index("How it drove") : page.index("Report: out")]
    rows, expected = (
        [line.split() for line in text.splitlines() if line.strip() and not re.match("Step|Report", line)]
        for text in (printed, shown)
    )
    assert [_words(row) for row in rows] == [_words(row) for row in expected]
    for row, known in zip(rows, expected, strict=True):  # to what processors differ by
        assert _numbers(row) == pytest.approx(_numbers(known), rel=0.1, abs=0.02), row


def _numbers(row):
    return [float(word.replace(",", "")) for word in row if re.fullmatch(r"-?[\d,]+(\.\d+)?", word)]


def _words(row):
    return [word for word in row if not re.fullmatch(r"-?[\d,]+(\.\d+)?", word)]


def test_own_parts_are_short():
    text = (DOCS / "extend-it.md").read_text(encoding="utf-8")
    for block in list(BLOCK.finditer(text))[1:]:
        assert len([line for line in block["code"].splitlines() if line.strip()]) <= 26
