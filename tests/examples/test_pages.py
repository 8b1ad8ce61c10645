"""Code of pages that show how to do something: it runs in the order of the page, and prints what stands below it."""

import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"```python\n(?P<code>.*?)```(?:\n+```text\n(?P<output>.*?)```)?", re.DOTALL)


@pytest.mark.parametrize("page", ["closed-loop", "step-it-yourself", "extend-it", "logs"])
def test_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
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


def test_own_parts_are_short():
    text = (DOCS / "extend-it.md").read_text(encoding="utf-8")
    for block in list(BLOCK.finditer(text))[1:]:
        assert len([line for line in block["code"].splitlines() if line.strip()]) <= 26
