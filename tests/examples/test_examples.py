"""Every example runs, and stays short."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def run(script, folder):
    environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONWARNINGS": "error::DeprecationWarning:__main__"}
    return subprocess.run(
        [sys.executable, str(script)], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(script, tmp_path):
    assert len(script.read_text().splitlines()) < 60
    result = run(script, tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip()


def test_there_are_three():
    assert len(EXAMPLES) == 3


def test_the_readmes_example_runs(tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    assert len(blocks) == 1
    assert len(blocks[0].splitlines()) <= 33
    script = tmp_path / "readme.py"
    script.write_text(blocks[0])
    result = run(script, tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("OPTIMAL")
    assert (tmp_path / "servo.png").exists()
