"""Every backend of the real-time iteration computes the same: tailored = portable = reference."""

from functools import partial

import numpy as np
import pytest
from problems import BACKENDS, EXACT, PROBLEMS, advanced, car, made_with

import rumo
from rumo.controllers.engines.described import core_problem
from rumo.kernel.elimination import Equations
from rumo.registry import DISCRETIZATIONS, MODELS
from rumo.studies import PaperStudy
from rumo.studies.paper import PATH, paper_weights
from rumo.textbook import gas_pipeline, heat_rod, mass_chain, tubular_reactor
from rumo.transcription import Transcription
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel, friction_circles

PENALTY = rumo.Penalty(2.0, 1.0)
PENALTIES = {"soft": PENALTY, "l1": rumo.Penalty(0.5), "hard": None}


def of_bicycle(horizon, delay, penalty, **changes):
    _, x, _ = car()
    problem = rumo.Problem(
        dynamic_bicycle(PAPER_CAR),
        horizon=horizon,
        sampling_time=0.04,
        delay=delay,
        track=paper_weights(PATH),
        moves={"torque": rumo.Weight(5.0, range=600.0), "steering_rate": rumo.Weight(5.0, range=3.0)},
        bounds={"torque": (-300.0, 300.0), "steering_rate": (-1.5, 1.5), "delta": (-np.pi / 4.0, np.pi / 4.0)},
        constraints=friction_circles(PAPER_CAR, penalty),
        **changes,
    )
    return problem, x, {"p_x": 0.0, "p_y": 0.3, "psi": 0.1, "v_x": 8.3}


def of_four_wheel(horizon, delay, penalty, **changes):
    model = four_wheel(PAPER_CAR)
    problem = rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=0.005,
        delay=delay,
        track={"p_y": rumo.Weight(1.0, 3.0), "psi": rumo.Weight(1.0), "v_x": rumo.Weight(1.0, 5.0)},
        # Gentle: sliding tyres lose force with slip, and a wheel that spins is unstable at a rate near
        # 1 / sampling time, where implicit Euler is singular.
        moves={"torque": rumo.Weight(5.0, 600.0), "steering_rate": rumo.Weight(5.0, 3.0)},
        bounds={
            "torque": (-60.0, 60.0),
            "steering_rate": (-1.5, 1.5),
            "delta": rumo.Bounds(-0.002, 0.002, penalty),
        },
        **changes,
    )
    start = {"p_y": 0.05, "v_x": 8.0} | {name: 8.0 / PAPER_CAR.r for name in model.states if name[0] == "w"}
    return problem, [start.get(name, 0.0) for name in model.states], {"p_y": 0.0, "psi": 0.0, "v_x": 8.1}


def of_pendulum(horizon, delay, penalty, **changes):
    problem = rumo.Problem(
        MODELS["cart_pendulum"](),
        horizon=horizon,
        sampling_time=0.02,  # an unstable model over 60 longer steps is too badly conditioned to compare
        delay=delay,
        track={"position": rumo.Weight(1.0), "angle": rumo.Weight(1.0, range=0.5)},
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds={"force": (-6.0, 6.0), "speed": rumo.Bounds(-1.2, 1.2, penalty)},
        move_bounds={"force": (-3.0, 3.0)},
        **changes,
    )
    return problem, [0.2, 0.0, 0.05, 0.0], {"position": 0.0, "angle": 0.0}


def of_robertson(horizon, delay, penalty, **changes):
    problem = rumo.Problem(
        MODELS["robertson_reactor"](),
        horizon=horizon,
        sampling_time=2.0,
        delay=delay,
        track={"a": rumo.Weight(1.0, range=0.5)},
        moves={"dilution": rumo.Weight(0.01, range=0.1)},
        bounds={"dilution": (0.0, 0.05), "c": rumo.Bounds(upper=0.3, penalty=penalty)},
        **changes,
    )
    return problem, [0.8, 2.6e-5, 0.2], {"a": 0.84}


def of_robertson_dae(horizon, delay, penalty, **changes):
    problem = rumo.Problem(
        MODELS["robertson_dae"](),
        horizon=horizon,
        sampling_time=2.0,
        delay=delay,
        track={"c": rumo.Weight(1.0, range=0.5), "b": rumo.Weight(0.1, range=1e-5)},
        moves={"dilution": rumo.Weight(0.01, range=0.1)},
        bounds={"dilution": (0.0, 0.05), "c": rumo.Bounds(upper=0.17, penalty=penalty)},
        **changes,
    )
    return problem, [0.8, 2.6e-5], {"c": 0.16, "b": 2e-5}


def of_van_de_vusse(horizon, delay, penalty, **changes):
    problem = rumo.Problem(
        MODELS["van_de_vusse_reactor"](),
        horizon=horizon,
        sampling_time=36.0,
        delay=delay,
        track={"c_b": rumo.Weight(1.0, range=0.2)},
        moves={"flow": rumo.Weight(0.01, range=15.0), "cooling": rumo.Weight(0.01, range=4000.0)},
        bounds={
            "flow": (3.0, 35.0),
            "cooling": (-9000.0, 0.0),
            "temperature": rumo.Bounds(upper=115.5, penalty=penalty),
        },
        safe_input={"flow": 14.19, "cooling": -1113.5},
        **changes,
    )
    return problem, [2.14, 1.09, 114.2, 112.9], {"c_b": 1.11}


def of_van_der_pol(horizon, delay, penalty, **changes):
    problem = rumo.Problem(
        MODELS["van_der_pol"](),
        horizon=horizon,
        sampling_time=0.02,
        delay=delay,
        track={"position": rumo.Weight(1.0)},
        moves={"force": rumo.Weight(0.1)},
        bounds={"force": (-1.0, 1.0), "position": rumo.Bounds(lower=1.45, penalty=penalty)},
        **changes,
    )
    return problem, [1.6, -1.02], {"position": 1.5}


def of_rod(horizon, delay, penalty, cells=8, **changes):
    middle = f"t_{cells // 2 + 1}"
    problem = rumo.Problem(
        heat_rod(cells),
        horizon=horizon,
        sampling_time=20.0,
        delay=delay,
        track={middle: rumo.Weight(1.0, range=50.0)},
        moves={"heating": rumo.Weight(0.1, range=1e5)},
        bounds={"heating": (0.0, 1e5), "t_1": rumo.Bounds(upper=70.0, penalty=penalty)},
        **changes,
    )
    return problem, [20.0] * cells, {middle: 60.0}


def of_tube(horizon, delay, penalty, cells=5, **changes):
    place = np.linspace(0.0, 1.0, cells)
    problem = rumo.Problem(
        tubular_reactor(cells),
        horizon=horizon,
        sampling_time=10.0,
        delay=delay,
        track={f"c_{cells}": rumo.Weight(1.0, range=500.0)},
        moves={"jacket": rumo.Weight(0.1, range=20.0)},
        bounds={"jacket": (57.0, 77.0), "t_3": rumo.Bounds(upper=89.0, penalty=penalty)},
        safe_input={"jacket": 67.0},
        **changes,
    )
    return problem, np.r_[4600.0 - 1000.0 * place, 72.0 + 12.0 * place], {f"c_{cells}": 3400.0}


def of_chain(horizon, delay, penalty, masses=12, **changes):
    problem = rumo.Problem(
        mass_chain(masses),
        horizon=horizon,
        sampling_time=0.5,
        delay=delay,
        track={"x_1": rumo.Weight(1.0), f"x_{masses}": rumo.Weight(1.0)},
        moves={"force": rumo.Weight(0.1)},
        bounds={"force": (-0.5, 0.5), "x_2": rumo.Bounds(-1.0, 0.32, penalty)},
        **changes,
    )
    return problem, [0.3] * masses + [0.0] * masses, {"x_1": 0.0, f"x_{masses}": 0.0}


def of_pipeline(horizon, delay, penalty, sections=6, **changes):
    problem = rumo.Problem(
        gas_pipeline(sections),
        horizon=horizon,
        sampling_time=600.0,
        delay=delay,
        track={f"q_{sections}": rumo.Weight(1.0, range=50.0)},
        moves={"supply": rumo.Weight(0.1, range=50.0)},
        bounds={"supply": (0.0, 100.0), "p_1": rumo.Bounds(upper=64.0, penalty=penalty)},
        safe_input={"supply": 60.0},
        **changes,
    )
    return problem, np.linspace(61.0, 51.0, sections), {f"q_{sections}": 70.0}


CASES = {
    "dynamic_bicycle": of_bicycle,
    "four_wheel": of_four_wheel,
    "cart_pendulum": of_pendulum,
    "robertson_reactor": of_robertson,
    "robertson_dae": of_robertson_dae,
    "van_de_vusse_reactor": of_van_de_vusse,
    "van_der_pol": of_van_der_pol,
    "heat_rod": of_rod,
    "tubular_reactor": of_tube,
    "mass_chain": of_chain,
    "gas_pipeline": of_pipeline,
}
SCHEMES = {name: scheme() for name, scheme in DISCRETIZATIONS.items()} | {
    "3 implicit-euler": rumo.ImplicitEuler(substeps=3),
    "2 bdf2": rumo.Bdf2(substeps=2),
    "2 radau2": rumo.Radau2(substeps=2),
    "2 gauss2": rumo.Gauss2(substeps=2),
    "40 rk4": rumo.Rk4(substeps=40),
}
NOT_STIFF = ("cart_pendulum", "van_de_vusse_reactor")
SCHEMES_OF_MODELS = [
    pytest.param(scheme, model, id=f"{name}-{model}")
    for name, scheme in SCHEMES.items()
    for model in (NOT_STIFF if scheme.explicit else CASES)
]
HORIZONS = [(1, 0), (2, 1), (4, 3), (9, 2), (16, 0), (25, 1), (60, 3)]


def usual(often):
    """Marks of a case: those that are not usual are slow."""
    return () if often else pytest.mark.slow


def drive(controllers, problem, x, reference, samples=6):
    """Plans of all controllers, sample by sample; the first one's plan moves the state."""
    rng = np.random.default_rng(7)
    x = np.array(x, dtype=float)
    for _ in range(samples):
        plans = [controller.step(x, reference) for controller in controllers]
        yield plans
        shake = 1e-4 * rng.standard_normal(len(x)) * np.maximum(np.abs(x), 1e-3)
        x = advanced(controllers[0], x, plans[0].u.values[0]) + shake
        for controller in controllers[1:]:
            controller.applied = controllers[0].applied


NOTHING = 1e-6
"""Of a state, in its unit: what stays below it is the rounding of larger ones."""


def assert_same(problem, first, second, tolerance):
    assert second.status is first.status
    assert second.cause is first.cause
    scale = problem.input_scales
    np.testing.assert_allclose(second.u.values / scale, first.u.values / scale, rtol=0.0, atol=tolerance)
    size = np.abs(first.x.values).max(axis=0) + NOTHING
    np.testing.assert_allclose(second.x.values / size, first.x.values / size, rtol=0.0, atol=tolerance)
    amount = problem.constraint_scales + np.abs(first.slacks.values).max(axis=0)
    np.testing.assert_allclose(second.slacks.values / amount, first.slacks.values / amount, rtol=0.0, atol=tolerance)
    size = np.abs(first.z.values).max(axis=0) + NOTHING
    np.testing.assert_allclose(second.z.values / size, first.z.values / size, rtol=0.0, atol=tolerance)


def test_every_model_is_here():
    assert set(CASES) == set(MODELS)


def compare(case, horizon, delay, penalty, backends, tolerance, scheme=None):
    problem, x, reference = case(horizon, delay, penalty)
    controllers = [made_with(problem, backend, scheme) for backend in backends]
    assert all(c.backend == b for c, b in zip(controllers, backends, strict=True) if b not in BACKENDS)
    for first, *others in drive(controllers, problem, x, reference):
        for other in others:
            assert_same(problem, first, other, tolerance)


@pytest.mark.parametrize(
    ("name", "horizon", "delay", "penalty"),
    [
        pytest.param(name, *size, penalty, id=f"{name}-{size[0]}-{kind}", marks=usual((i + j) % 3 == k))
        for i, name in enumerate(CASES)
        for j, size in enumerate(HORIZONS)
        for k, (kind, penalty) in enumerate(PENALTIES.items())  # any two together, all three in slow tests
    ],
)
def test_portable_equals_reference(name, horizon, delay, penalty):
    compare(CASES[name], horizon, delay, penalty, BACKENDS, 1e-7)


# A tailored core takes seconds to build: a car, and coupled stages of a model with algebraic variables; others in CI.
@pytest.mark.parametrize("name", [pytest.param(name, marks=usual(name == "dynamic_bicycle")) for name in CASES])
def test_tailored_equals_portable(name, kept_builds):
    for penalty in (PENALTY, None):
        compare(CASES[name], 16, 1, penalty, ("portable", "tailored"), 1e-9)


@pytest.mark.parametrize("backend", ["portable", pytest.param("tailored", marks=pytest.mark.slow)])
def test_where_a_pivot_vanishes(backend, kept_builds):
    """What is stiff at set-up has the first pivot, 1 - T growth; at some stages that is next to nothing."""
    period = 0.125
    model = rumo.Model(
        states={"a": "1", "b": "1"},
        inputs={"u": "1"},
        parameters={"growth": rumo.Parameter("1/s", -500.0)},
        dynamics=lambda x, u, p: {"a": p.growth * x.a + 3.0 * x.b + u.u, "b": x.b - 4.0 * x.a - x.b**3},
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=period,
        delay=1,
        track={"b": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(0.1)},
        bounds={"u": (-5.0, 5.0)},
    )
    controllers = [rumo.RealTimeIteration(problem, qp=EXACT, backend=name) for name in ("reference", backend)]
    assert controllers[1].backend == backend
    growth = np.full(20, -3.0)
    growth[[3, 4, 12]] = np.array([1.0, 1.0 - 1e-14, 1.0 - 1e-12]) / period
    for controller in controllers:
        controller.parameters = {"growth": growth}
    for first, second in drive(controllers, problem, [0.1, 0.3], {"b": 0.5}):
        assert first.status.solved
        assert_same(problem, first, second, 1e-9)


@pytest.mark.parametrize(
    ("scheme", "model", "horizon", "delay"),
    [
        pytest.param(*pair.values, *size, id=f"{pair.id}-{size[0]}", marks=usual(i % 3 == j))
        for i, pair in enumerate(SCHEMES_OF_MODELS)
        for j, size in enumerate([(1, 0), (9, 2), (16, 0)])  # any two together, all three in slow tests
    ],
)
def test_every_scheme_portable_equals_reference(scheme, model, horizon, delay):
    compare(CASES[model], horizon, delay, PENALTY, BACKENDS, 1e-7, scheme)


@pytest.mark.parametrize("name", [pytest.param(name, marks=usual(name == "radau3")) for name in SCHEMES])
def test_every_scheme_tailored_equals_portable(name, kept_builds):
    model = "cart_pendulum" if SCHEMES[name].explicit else "robertson_dae"
    compare(CASES[model], 9, 2, PENALTY, ("portable", "tailored"), 1e-9, SCHEMES[name])


WIDE = {
    "rod": partial(of_rod, cells=30),
    "rod, held": partial(of_rod, cells=30, blocks=rumo.InputBlocks([1, 2, 4])),
    "tube": partial(of_tube, cells=16),
    "chain": partial(of_chain, masses=22),
    "pipeline": partial(of_pipeline, sections=26),
}
"""Models whose equations are solved without maps."""


def is_wide(problem, solver="auto"):
    values = core_problem(Transcription(problem), solver).values
    assert values["condensing"] or values["elimination_blocks"]
    return values["elimination_blocks"] == 0


def test_which_models_are_wide():
    assert all(is_wide(case(9, 2, PENALTY)[0]) for case in WIDE.values())
    assert not any(is_wide(CASES[name](9, 2, PENALTY)[0]) for name in ("dynamic_bicycle", "heat_rod"))


def test_riccati_sweeps_have_maps_of_wide_models():
    problem, x, reference = WIDE["rod"](50, 2, PENALTY)
    assert is_wide(problem)
    assert not is_wide(problem, "riccati")
    assert not is_wide(WIDE["rod"](300, 2, PENALTY)[0])
    solvers = [rumo.QpOptions(solver=solver, tolerance=1e-12) for solver in ("auto", "riccati")]
    controllers = [rumo.RealTimeIteration(problem, qp=qp, backend="portable") for qp in solvers]
    for first, second in drive(controllers, problem, x, reference):
        assert_same(problem, first, second, 1e-7)


@pytest.mark.parametrize(
    ("name", "scheme", "penalty"),
    [
        pytest.param(name, scheme, PENALTIES[kind], id=f"{name}-{scheme}-{kind}", marks=usual((i + j) % 2 == k))
        for i, name in enumerate(WIDE)
        for j, scheme in enumerate(("implicit-euler", "trapezoidal", "gauss2", "2 radau2"))
        for k, kind in enumerate(("soft", "hard"))  # any two together, all three in slow tests
    ],
)
def test_wide_models_portable_equals_reference(name, scheme, penalty):
    compare(WIDE[name], 9, 2, penalty, ("reference", "portable"), 1e-7, SCHEMES[scheme])


def test_the_solver_stays_what_was_made():
    for case, horizon, made in ((WIDE["rod"], 50, "condensing"), (CASES["dynamic_bicycle"], 15, "riccati")):
        problem, x, reference = case(horizon, 2, PENALTY)
        controller = rumo.RealTimeIteration(problem, backend="portable")
        controller.configure(qp=rumo.QpOptions(max_iterations=500))
        controller.configure(qp=rumo.QpOptions(solver=made))
        other = "riccati" if made == "condensing" else "condensing"
        with pytest.raises(rumo.ArgumentError, match=f"got '{other}', expected '{made}', as made"):
            controller.configure(qp=rumo.QpOptions(solver=other))
        assert controller.settings.qp.solver == made
        assert controller.step(x, reference).status.solved


@pytest.mark.filterwarnings("ignore::rumo.UnstableModeWarning")  # rightly
def test_wide_model_without_a_pivot_on_the_diagonal(monkeypatch):
    """Implicit Euler over 1 s: 1 - h df/dx is 0 on the diagonal, though not by structure."""
    names = [f"x_{i}" for i in range(30)]

    def dynamics(x, u, p):
        x = [0.0, *(getattr(x, name) for name in names), 0.0]
        push = {"x_0": u.push}
        return {name: p.rate * x[i + 1] + x[i + 2] - x[i] + push.get(name, 0.0) for i, name in enumerate(names)}

    model = rumo.Model(
        dict.fromkeys(names, "1"), {"push": "1/s"}, dynamics, parameters={"rate": rumo.Parameter("1/s", 1.0)}
    )
    problem = rumo.Problem(
        model,
        horizon=2,
        sampling_time=1.0,
        track={"x_0": rumo.Weight(1.0)},
        moves={"push": rumo.Weight(1.0)},
        bounds={"push": (-1.0, 1.0), "x_1": rumo.Bounds(upper=0.5, penalty=PENALTY)},
    )
    assert is_wide(problem)
    controllers = [rumo.RealTimeIteration(problem, qp=EXACT, backend="portable")]
    monkeypatch.setattr(Equations, "wide", lambda *_: False)  # blocks with row exchanges instead
    controllers.append(rumo.RealTimeIteration(problem, qp=EXACT, backend="portable"))
    for first, second in drive(controllers, problem, [0.3] * 30, {"x_0": 0.0}, samples=2):
        assert_same(problem, first, second, 1e-9)


@pytest.mark.slow
def test_wide_models_tailored_equals_portable(kept_builds):
    compare(WIDE["pipeline"], 9, 2, PENALTY, ("portable", "tailored"), 1e-9, rumo.Radau2(substeps=2))


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "model"), SCHEMES_OF_MODELS)
def test_every_scheme_tailored_equals_portable_for_every_model(scheme, model, kept_builds):
    for penalty in PENALTIES.values():
        compare(CASES[model], 9, 2, penalty, ("portable", "tailored"), 1e-9, scheme)


@pytest.mark.slow
@pytest.mark.parametrize(("horizon", "delay"), HORIZONS)
@pytest.mark.parametrize("name", CASES)
def test_tailored_equals_portable_and_reference(name, horizon, delay, kept_builds):
    for penalty in PENALTIES.values():
        compare(CASES[name], horizon, delay, penalty, ("portable", "tailored"), 1e-9)
        compare(CASES[name], horizon, delay, penalty, ("reference", "tailored"), 1e-7)


@pytest.mark.parametrize("name", PROBLEMS)
def test_iterated_to_convergence_too(name):
    problem, x, reference = PROBLEMS[name]()
    plans = [
        rumo.RealTimeIteration(problem, sqp_iterations=60, tolerance=1e-11, qp=EXACT, backend=backend).step(
            x, reference
        )
        for backend in ("reference", "portable")
    ]
    assert_same(problem, *plans, 1e-7)


def test_the_paper_study_comes_out_the_same(monkeypatch):
    logs = []
    for backend in ("reference", "portable"):
        monkeypatch.setenv("RUMO_BACKEND", backend)
        logs.append(PaperStudy(("rti",), duration=4.0).run()["rti"])
    applied = [log.applied.values for log in logs]
    assert np.max(np.abs(applied[1] - applied[0]) / np.ptp(applied[0], axis=0)) <= 1e-8
    assert list(logs[0].status.values) == list(logs[1].status.values)


@pytest.mark.parametrize("scheme", DISCRETIZATIONS)
def test_a_single_state(scheme):
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": u.u - x.x**3})
    problem = rumo.Problem(
        model, horizon=6, sampling_time=0.1, track={"x": rumo.Weight(1.0)}, moves={"u": rumo.Weight(0.1)}
    )
    plans = [made_with(problem, backend, DISCRETIZATIONS[scheme]()).step([1.0], {"x": 0.2}) for backend in BACKENDS]
    for plan in plans:
        assert plan.status is rumo.Status.OPTIMAL
        np.testing.assert_allclose(plan.u.values, plans[0].u.values, atol=1e-10)
