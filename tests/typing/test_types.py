"""A user's code passes the type checker, and names mean to it what they mean at run time."""

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from problems import pendulum

import rumo

FOLDER = Path(__file__).parent
SETTINGS = dict.fromkeys(("reportUnknownMemberType", "reportUnknownLambdaType", "reportMissingTypeStubs"), False)


needs_pyright = pytest.mark.skipif(find_spec("pyright") is None, reason="pyright is not installed")


def check(code, folder):
    (folder / "code.py").write_text(code)
    (folder / "pyrightconfig.json").write_text(json.dumps(SETTINGS | {"typeCheckingMode": "strict"}))
    command = [
        sys.executable,
        "-m",
        "pyright",
        "--project",
        str(folder),
        "--pythonpath",
        sys.executable,
        "--outputjson",
    ]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    report = json.loads(result.stdout)
    assert report["summary"]["filesAnalyzed"] == 1
    return [f"{each['range']['start']['line'] + 1}: {each['message']}" for each in report["generalDiagnostics"]]


@needs_pyright
@pytest.mark.parametrize("script", sorted(FOLDER.glob("*_code.py")), ids=lambda path: path.stem)
def test_a_users_code_type_checks(script, tmp_path):
    assert check(script.read_text(), tmp_path) == []


@needs_pyright
def test_mistakes_are_found(tmp_path):
    code = (
        (FOLDER / "users_code.py").read_text()
        + """
problem.changed(weight={})
word: str = plan.command["f"]
"""
    )
    found = check(code, tmp_path)
    assert [message.split(": ")[1].split(" ")[0] for message in found] == ["No", "Type"], found


def test_a_users_code_runs():
    exec(compile((FOLDER / "users_code.py").read_text(), "users_code.py", "exec"), {"__name__": "users_code"})


def test_a_command_is_a_float():
    plan = rumo.RealTimeIteration(pendulum()).step([0.1, 0.0], {"angle": 0.0})
    assert isinstance(plan.command["torque"], float)
    assert isinstance(plan.command.as_dict()["torque"], float)
    assert isinstance(plan.u["torque"], np.ndarray)
    assert np.shares_memory(plan.u["torque"], plan.u.values)
