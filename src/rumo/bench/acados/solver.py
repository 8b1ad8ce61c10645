"""A generated solver of acados, which replays drives."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import io
import itertools
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from rumo.bench.acados.driver import FUNCTIONS, GUESSES, POINTERS, Replay, Target, replay
from rumo.bench.acados.statement import Statement
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.replay import Recording

COMPILER_FLAGS = "-O3 -march=native"

_numbers = itertools.count()


class AcadosRti:
    """SQP_RTI of acados with implicit Euler, on the discretised problem that `rumo.RealTimeIteration` solves.

    Parameters
    ----------
    problem : Problem
        What to solve.
    qp_solver : str
        acados' name: "FULL_CONDENSING_DAQP" or "PARTIAL_CONDENSING_HPIPM".
    integrator : str
        "IRK" or "LIFTED_IRK", acados' own implicit integrators, or "DISCRETE", the Newton step eliminated symbolically
        by hand.
    block : int
        Stages that partial condensing joins to one.

    Notes
    -----
    Implicit Euler is the one-stage Radau IIA method with one Newton step from the guess. IRK takes the derivatives
    after that step, DISCRETE and Rumo before it. LIFTED_IRK keeps its guess from sample to sample without a shift:
    acados offers no way to set it.
    """

    def __init__(self, problem: Problem, qp_solver: str, integrator: str = "IRK", block: int = 1) -> None:
        acados: Any = importlib.import_module("acados_template")
        self.problem, self.integrator = problem, integrator
        self._statement = statement = Statement(problem, acados.ACADOS_INFTY)
        ocp = acados.AcadosOcp()
        ocp.model.name = f"rumo_{next(_numbers)}"
        statement.write(ocp, integrator)
        N, options = problem.horizon, ocp.solver_options
        options.N_horizon, options.tf = N, N * problem.sampling_time
        options.cost_scaling = np.ones(N + 1)  # not by the time step
        options.nlp_solver_type, options.hessian_approx = "SQP_RTI", "GAUSS_NEWTON"
        options.integrator_type, options.collocation_type = integrator, "GAUSS_RADAU_IIA"
        options.sim_method_num_stages = options.sim_method_num_steps = options.sim_method_newton_iter = 1
        options.qp_solver = qp_solver
        if qp_solver == "PARTIAL_CONDENSING_HPIPM":
            options.hpipm_mode, options.qp_solver_cond_N = "SPEED_ABS", max(1, N // block)
            options.qp_solver_warm_start = 2
        else:
            # With 2, DAQP would keep the matrices of the first QP.
            options.qp_solver_warm_start, options.qp_solver_iter_max = 1, 1000
        ocp.code_gen_options.ext_fun_compile_flags = COMPILER_FLAGS
        with (
            tempfile.TemporaryDirectory(prefix="rumo-acados-") as folder,
            warnings.catch_warnings(),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            warnings.simplefilter("ignore")
            ocp.code_gen_options.code_export_directory = str(Path(folder) / "code")
            self._solver = acados.AcadosOcpSolver(ocp, verbose=False)
        statement.set_stages(self._solver)

    def condense(self, block: int) -> None:
        """Join another number of stages to one; for HPIPM."""
        with contextlib.redirect_stdout(io.StringIO()):
            self._solver.update_qp_solver_cond_N(max(1, self.problem.horizon // block))
        self._statement.set_stages(self._solver)

    def replay(self, recording: Recording) -> Replay:
        """From a guess at rest in the first state, with the inputs that are decided then."""
        problem, statement = self.problem, self._statement
        self._solver.reset()
        applied = recording.applied / problem.input_scales
        decided = np.tile(problem.safe_input / problem.input_scales, (statement.augmented.memory, 1))
        guess_x = np.tile(np.r_[recording.x[0], decided.ravel()], (problem.horizon + 1, 1))
        guess_u = np.tile(decided[-1], (problem.horizon, 1))
        drive = {"x": recording.x, "reference": recording.reference, "applied": applied}
        return replay(self._target(applied), drive, statement.offset, (guess_x, guess_u), decided)

    def _target(self, applied: Array) -> Target:
        """Where the loop finds all that it needs; a solver that was changed is somewhere else."""
        solver, problem, model = self._solver, self.problem, self.problem.model
        pointers = (
            solver.nlp_config,
            solver.nlp_dims,
            solver.nlp_in,
            solver.nlp_out,
            solver.nlp_solver,
            solver.nlp_opts,
            solver.capsule,
        )
        functions = {name: getattr(solver.acados_lib, symbol) for name, symbol in FUNCTIONS.items()}
        functions["solve"] = getattr(solver.shared_lib, f"{solver.ocp.name}_acados_solve")
        return Target(
            horizon=problem.horizon,
            states=len(model.states),
            inputs=len(model.inputs),
            outputs=self._statement.augmented.outputs.numel(),
            memory=self._statement.augmented.memory,
            told=applied.shape[1],
            guess=GUESSES[self.integrator],
            sampling_time=problem.sampling_time,
            **dict(zip(POINTERS, pointers, strict=True)),
            **{name: ctypes.cast(function, ctypes.c_void_p) for name, function in functions.items()},
        )
