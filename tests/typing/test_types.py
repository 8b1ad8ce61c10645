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


@pytest.mark.skipif(find_spec("pyright") is None, reason="pyright is not installed")
@pytest.mark.parametrize("script", sorted(FOLDER.glob("*_code.py")), ids=lambda path: path.stem)
def test_a_users_code_type_checks(script, tmp_path):
    project = tmp_path / "pyrightconfig.json"
    project.write_text(json.dumps(SETTINGS | {"include": [str(script)], "typeCheckingMode": "strict"}))
    command = [sys.executable, "-m", "pyright", "--project", str(project), "--pythonpath", sys.executable]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr


def test_a_command_is_a_float():
    plan = rumo.RealTimeIteration(pendulum()).step([0.1, 0.0], {"angle": 0.0})
    assert isinstance(plan.command["torque"], float)
    assert isinstance(plan.command.as_dict()["torque"], float)
    assert isinstance(plan.u["torque"], np.ndarray)
    assert np.shares_memory(plan.u["torque"], plan.u.values)
