"""Rivals from pip alone solve the problem that is ours."""

import shutil

import numpy as np
import pytest

from rumo.bench import record
from rumo.bench.rivals import CasadiSqp
from rumo.bench.rivals.do_mpc import DoMpc
from rumo.bench.runners import installed


@pytest.fixture(scope="module", params=["easy", "limit"])
def recording(request):
    return record(request.param, 10, 80)


@pytest.mark.parametrize(("qp_solver", "far"), [("hpipm", 1e-6), ("osqp", 1e-2)])  # OSQP stops at 1e-3
def test_casadi_finds_the_commands_of_the_drive(recording, qp_solver, far):
    if not installed(f"casadi-{qp_solver}"):
        pytest.skip(f"this CasADi has no {qp_solver}")
    rival = CasadiSqp(recording.problem, qp_solver, compiled=False)
    for _ in range(2):  # the second time from nothing again
        rival.reset()
        commands = []
        for x, reference, applied in zip(recording.x, recording.reference, recording.applied, strict=True):
            rival.applied = applied
            rival.prepare()
            commands.append(rival.feedback(x, reference))
        difference = (np.array(commands[:-1]) - recording.applied[1:, -1]) / recording.problem.input_scales
        assert np.abs(difference).max() < far


@pytest.mark.skipif(shutil.which("gcc") is None, reason="CasADi calls gcc")
@pytest.mark.skipif(not installed("casadi-osqp"), reason="this CasADi has no osqp")
def test_compiled_casadi_does_the_same_and_leaves_no_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = record("easy", 2, 1)
    rivals = [CasadiSqp(recording.problem, "osqp", compiled=compiled) for compiled in (False, True)]
    commands = [rival.feedback(recording.x[0], recording.reference[0]) for rival in rivals]
    assert commands[0].all()
    np.testing.assert_allclose(*commands, rtol=1e-6)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not installed("do-mpc"), reason="do-mpc is installed apart from the package")
def test_do_mpc_finds_nearly_the_commands_of_the_drive(recording):
    """It converges where the drive took one step a sample, and prices violations by their linear penalty only."""
    rival, far = DoMpc(recording.problem), []
    for x, reference, applied in list(zip(recording.x, recording.reference, recording.applied, strict=True))[:20]:
        rival.applied = applied
        rival.prepare()
        far.append(rival.feedback(x, reference))
    difference = (np.array(far) - recording.applied[1:21, -1]) / recording.problem.input_scales
    assert np.abs(difference[5:]).max() < 0.02
