"""Unstable modes: whether a prediction sees them, and who is told if it does not."""

import warnings

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import ortho_group

import rumo
from rumo.discretization.growth import MisjudgedMode, cures, interval_factors, is_misjudged, misjudged_mode
from rumo.registry import DISCRETIZATIONS, MODELS
from rumo.textbook import cart_pendulum


def linear(A, B, names=None):
    """A linear model `xdot = A x + B u` of states in m."""
    A, B = np.atleast_2d(A), np.atleast_2d(B)
    names = names or [f"x{i}" for i in range(len(A))]

    def rates(x, u, p):
        return {
            name: sum(A[i, j] * getattr(x, other) for j, other in enumerate(names)) + B[i, 0] * u.push
            for i, name in enumerate(names)
        }

    return rumo.Model(dict.fromkeys(names, "m"), {"push": "m/s"}, rates, name="linear")


def steered(model, sampling_time, horizon=12, **settings):
    """Bring all states to 0, with inputs as large as need be."""
    settings = {
        "track": {name: rumo.Weight(1.0) for name in model.states},
        "moves": {name: rumo.Weight(1e-3) for name in model.inputs},
        "bounds": dict.fromkeys(model.inputs, (-1e4, 1e4)),
    } | settings
    return rumo.Problem(model, horizon=horizon, sampling_time=sampling_time, **settings)


def driven(controller, A, B, x, samples=12):
    """States of the plant `xdot = A x + B u` (samples + 1, nx), and the statuses."""
    A, B, h = np.atleast_2d(A), np.atleast_2d(B), controller.problem.sampling_time
    nx = len(A)
    exact = expm(h * np.block([[A, B], [np.zeros((1, nx + 1))]]))
    states, statuses = [np.array(x, dtype=float)], set()
    for _ in range(samples):
        plan = controller.step(states[-1], dict.fromkeys(controller.problem.outputs, 0.0))
        statuses.add(plan.status)
        states.append(exact[:nx, :nx] @ states[-1] + exact[:nx, nx] * plan.command.values[0])
    return np.array(states), statuses


COUPLED = np.array([[1.8, 0.3], [0.2, -4.0]]), np.array([[1.0], [0.3]])
TURNING = np.array([[1.0, 4.0], [-4.0, 1.0]]), np.array([[0.0], [1.0]])
UPRIGHT = np.array([[0.0, 1.0], [9.81, 0.0]]), np.array([[0.0], [1.0]])
PLANTS = {
    "scalar": (np.array([[1.8]]), np.array([[1.0]]), 1.0, ["x"], ["x"]),
    "coupled": (*COUPLED, 1.0, ["runaway", "settled"], ["runaway"]),
    "turning": (*TURNING, 0.35, ["east", "north"], ["east", "north"]),
    "pendulum": (*UPRIGHT, 0.5, ["angle", "rate"], ["angle", "rate"]),
}


@pytest.mark.parametrize(("A", "B", "step", "names", "guilty"), PLANTS.values(), ids=PLANTS)
def test_a_warning_names_the_mode_and_what_it_says_holds_the_plant(A, B, step, names, guilty):
    problem, x = steered(linear(A, B, names), step, moves={"push": rumo.Weight(0.5)}), np.full(len(A), 1e-2)
    with pytest.warns(rumo.UnstableModeWarning) as caught:
        controller = rumo.RealTimeIteration(problem, gate=None)
    said = str(caught.list[0].message)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    named = said.removeprefix("linear: ").partition(" ha")[0].split(" and ")
    assert sorted(named) == sorted(guilty)
    rate = np.linalg.eigvals(A).real.max()
    assert f"time constant of {1.0 / rate:.2g} s" in said
    assert "Radau" in said
    assert ("with a period of" in said) == bool(np.iscomplex(np.linalg.eigvals(A)).any())

    states, statuses = driven(controller, A, B, x, samples=25)
    assert not np.abs(states[-1]).max() < 1.0
    assert statuses == {rumo.Status.OPTIMAL}
    plan = controller.step(x, dict.fromkeys(names, 0.0))
    assert said.removeprefix("linear: ").partition(": over")[0] in str(controller.explain(plan))

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        better = rumo.RealTimeIteration(problem, rumo.Radau2(), gate=None)
    states, _ = driven(better, A, B, x, samples=25)
    assert np.abs(states[-1]).max() < 0.1 * np.abs(x).max()
    assert "Misjudged" not in str(better.explain(better.step(x, dict.fromkeys(names, 0.0))))


@pytest.mark.parametrize("z", [0.5, 0.9, 1.1, 1.6, 2.4, 3.0, 5.0])
@pytest.mark.parametrize("scheme", DISCRETIZATIONS.values(), ids=DISCRETIZATIONS)
def test_what_is_misjudged_is_what_cannot_be_held(scheme, z):
    """By a feedback that inputs cost nothing; and what the warning says holds it."""
    problem = steered(linear(z, 1.0), 1.0, moves={"push": rumo.Weight(1e-6)}, bounds={"push": (-1e9, 1e9)})
    product = np.array([z + 0.0j])
    misjudged = bool(is_misjudged(scheme(), product)[0])
    if scheme.explicit:  # it may be meant as a model in discrete time
        assert not misjudged
        return

    def end(scheme):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rumo.UnstableModeWarning)
            controller = rumo.RealTimeIteration(problem, scheme, gate=None, backend="portable")
        return np.abs(driven(controller, z, 1.0, [1e-2])[0][-1]).max()

    assert (end(scheme()) > 1e-2) == misjudged
    for cure in cures(scheme(), complex(product[0])) if misjudged else ():
        assert end(cure) < 1e-4


@pytest.mark.parametrize(
    "z", [0.5 + 1.0j, 1.5 + 2.0j, *(pytest.param(z, marks=pytest.mark.slow) for z in (1.0 + 1.0j, 2.0 + 1.0j))]
)
@pytest.mark.parametrize("scheme", [name for name in DISCRETIZATIONS if not DISCRETIZATIONS[name].explicit])
def test_a_mode_that_turns_is_misjudged_where_one_input_cannot_hold_it(scheme, z):
    """It takes two intervals, in which errors grow: Radau2 predicts `1.5 + 2i` to 20 %, and loses it."""
    A, B = np.array([[z.real, z.imag], [-z.imag, z.real]]), np.array([[0.0], [1.0]])
    problem = steered(linear(A, B, ["a", "b"]), 1.0, moves={"push": rumo.Weight(1e-6)}, bounds={"push": (-1e9, 1e9)})

    def end(scheme):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rumo.UnstableModeWarning)
            controller = rumo.RealTimeIteration(problem, scheme, gate=None, backend="portable")
        return np.abs(driven(controller, A, B, [1e-2, 0.0], samples=40)[0][-1]).max()

    misjudged = bool(is_misjudged(DISCRETIZATIONS[scheme](), np.array([z]))[0])
    assert misjudged == (end(DISCRETIZATIONS[scheme]()) > 1e-2)
    for cure in cures(DISCRETIZATIONS[scheme](), z) if misjudged else ():
        assert end(cure) < 1e-4


@pytest.mark.parametrize("z", [0.5 + 0.02j, 0.5 + 0.5j, 0.7 + 0.7j])
def test_two_inputs_hold_a_mode_that_turns_within_an_interval(z):
    A = np.array([[z.real, z.imag], [-z.imag, z.real]])
    model = rumo.Model(
        {"a": "m", "b": "m"},
        {"one": "m/s", "other": "m/s"},
        lambda x, u, p: {"a": z.real * x.a + z.imag * x.b + u.one, "b": -z.imag * x.a + z.real * x.b + u.other},
    )
    controller = rumo.RealTimeIteration(steered(model, 1.0), gate=None, backend="portable")  # a warning is an error
    exact = expm(np.block([[A, np.eye(2)], [np.zeros((2, 4))]]))
    x = np.array([1e-2, 0.0])
    for _ in range(40):
        plan = controller.step(x, {"a": 0.0, "b": 0.0})
        x = exact[:2] @ np.r_[x, plan.command.values]
    assert np.abs(x).max() < 1e-5
    assert "Misjudged" not in str(controller.explain(plan))


@pytest.mark.parametrize("make", [rumo.DirectNlp, rumo.LinearTimeVarying])
def test_every_controller_warns(make):
    with pytest.warns(rumo.UnstableModeWarning, match="x0 has an unstable mode"):
        make(steered(linear(3.0, 1.0), 1.0))


def test_the_interval_that_is_too_long_is_named():
    grid = rumo.Grid([0.1] * 6 + [0.4, 0.8])
    with pytest.warns(rumo.UnstableModeWarning, match=r"interval of 0\.8 s before stage 8"):
        rumo.RealTimeIteration(steered(linear(3.0, 1.0), 0.1, horizon=grid))


@pytest.mark.parametrize("jump", [19.0, 30.0, 1e4])
def test_a_jump_to_another_state_hides_no_mode_that_an_input_could_hold(jump):
    alone, both = (linear(np.diag(rates), np.ones((len(rates), 1))) for rates in ([jump], [jump, 3.0]))
    rumo.RealTimeIteration(steered(alone, 1.0))  # warnings are errors
    with pytest.warns(
        rumo.UnstableModeWarning, match=r"linear: x1 has an unstable mode with a time constant of 0\.33 s"
    ):
        controller = rumo.RealTimeIteration(steered(both, 1.0), backend="portable")
    plan = controller.step(np.zeros(2), {"x0": 0.0, "x1": 0.0})
    assert "Misjudged: x1 has" in str(controller.explain(plan))


@pytest.mark.parametrize(
    ("rate", "believed"),
    [
        (1.5, "-2 times: plans believe that it changes its sign"),
        (2.0, "-1 times: plans believe that it changes its sign"),
        (2.5, "-0.67 times: plans believe that it decays"),
        (0.1 + 0.437j, "1 times: plans believe that it stays as it is"),
        (0.1 + 2.0j, "0.46 times: plans believe that it decays"),
    ],
)
def test_what_plans_believe_is_what_the_number_says(rate, believed):
    """Of implicit Euler, which multiplies a mode by 1 / (1 - z)."""
    rate = complex(rate)
    mode = MisjudgedMode(("x",), rate, 1, 1.0, 1.0 / (1.0 - rate))
    assert f"predicts {believed}" in mode.described(rumo.ImplicitEuler())


def test_algebraic_variables_are_eliminated():
    model = rumo.Model(
        {"x": "m"},
        {"push": "m/s"},
        lambda x, u, p: {"x": x.flow},
        algebraic={"flow": rumo.Algebraic("m/s", lambda x, u, p: x.flow - 3.0 * x.x - u.push)},
        name="through",
    )
    with pytest.warns(rumo.UnstableModeWarning, match="through: x has an unstable mode with a time constant of 0.33 s"):
        rumo.RealTimeIteration(steered(model, 1.0))


def test_away_from_an_equilibrium_a_mode_counts_if_it_is_everywhere():
    everywhere = rumo.Model({"x": "m"}, {"u": "m/s"}, lambda x, u, p: {"x": 3.0 * x.x + u.u + 1.0})
    with pytest.warns(rumo.UnstableModeWarning):
        rumo.RealTimeIteration(steered(everywhere, 1.0))
    near = rumo.Model({"x": "m"}, {"u": "m/s"}, lambda x, u, p: {"x": 3.0 * x.x - x.x**3 + u.u + 1.0})
    rumo.RealTimeIteration(steered(near, 1.0))  # warnings are errors


@pytest.mark.parametrize("scheme", DISCRETIZATIONS.values(), ids=DISCRETIZATIONS)
@pytest.mark.parametrize("name", MODELS)
def test_models_that_come_along_are_not_misjudged_at_usual_samples(name, scheme):
    model = MODELS[name]()
    if scheme.explicit and len(model.algebraic):
        pytest.skip("explicit schemes have no algebraic variables")
    rumo.DirectNlp(steered(model, 0.04), scheme())


def test_what_is_no_instability():
    rng = np.random.default_rng(0)
    for _ in range(50):  # integrators, oscillators, stiff modes and noise, in any coordinates
        kinds = [[0.0], [1e-9], [-1e5], [[0.0, 1.0], [0.0, 0.0]], [[-1e-12, 30.0], [-30.0, -1e-12]]]
        D = np.zeros((7, 7))
        at = 0
        for kind in kinds:
            block = np.atleast_2d(kind)
            D[at : at + len(block), at : at + len(block)] = block
            at += len(block)
        T = ortho_group.rvs(7, random_state=rng)
        A = T @ D @ T.T
        names = [f"x{i}" for i in range(7)]
        for scheme in DISCRETIZATIONS.values():
            assert misjudged_mode(scheme(), np.tile(A, (20, 1, 1)), np.full(20, 0.05), names) is None


def test_growth_is_what_the_stability_function_says():
    z = np.array([0.5, 1.5, 3.0, 0.1 + 2.0j, -3.0 + 0.0j], dtype=complex)
    np.testing.assert_allclose(interval_factors(rumo.ImplicitEuler(), z), 1.0 / (1.0 - z), rtol=1e-7)
    np.testing.assert_allclose(interval_factors(rumo.ImplicitEuler(2), z), (1.0 - z / 2.0) ** -2, rtol=1e-7)
    assert is_misjudged(rumo.ImplicitEuler(), z).tolist() == [False, True, True, True, False]
    assert not is_misjudged(rumo.ExplicitEuler(), z).any()
    assert is_misjudged(rumo.ImplicitEuler(), np.array([1.0 + 0.0j])).tolist() == [True]  # at its pole


def test_an_upright_pendulum_on_a_cart_is_told_at_set_up_and_by_explain():
    problem = steered(cart_pendulum(), 0.5, bounds={"force": (-100.0, 100.0)})
    with pytest.warns(rumo.UnstableModeWarning, match=r"cart_pendulum: (angle and rate|rate and angle) have"):
        controller = rumo.RealTimeIteration(problem)
    wanted = dict.fromkeys(problem.outputs, 0.0)
    assert "have an unstable mode" in str(controller.explain(controller.step(np.zeros(4), wanted)))
    hanging = np.array([0.0, 0.0, np.pi, 0.0])
    down = wanted | {"angle": np.pi}
    controller.reset()
    assert "unstable mode" not in str(controller.explain(controller.step(hanging, down)))
