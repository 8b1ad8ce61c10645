"""The core refuses what cannot be a problem, and says what is wrong."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from problems import car, pendulum, rod

import rumo
from rumo.controllers.engines.described import core_problem
from rumo.kernel import Core, Settings, as_numbers
from rumo.plan import DIAGNOSTICS


@pytest.fixture(scope="module")
def values():
    controller = rumo.RealTimeIteration(car()[0], backend="portable")
    return core_problem(controller.transcription).values


def changed(array, index, value):
    other = array.copy()
    other.flat[index] = value
    return other


WRONG = {
    "horizon": (lambda _: 0, "horizon: expected at least 1"),
    "delay": (lambda _: 15, "delay is too large"),
    "tape_code": (lambda a: changed(a, 0, 99), r"tape_code\[0\] is out of range"),
    "M_row": (lambda a: changed(a, 0, -1), r"M_row\[0\] is out of range"),
    "elimination_column": (lambda a: changed(a, 1, a[0]), r"elimination_column\[1\] comes out of order"),
    "elimination_store": (lambda a: changed(a, 1, 10**6), r"elimination_store\[1\] is out of range"),
    "elimination_sparse": (lambda a: changed(a, 1, 1), r"elimination_sparse\[1\] is out of range"),
    "shift_stages": (lambda a: changed(a, 2, 15), r"shift_stages\[2\] is out of range"),
    "sensors_age": (lambda a: changed(a, 8, 16), r"sensors_age\[8\] is out of range"),
    "output_weights": (lambda a: changed(a, 4, -1.0), r"output_weights\[4\] is negative"),
    "move_weights": (lambda a: changed(a, 0, 0.0), r"move_weights\[0\] is not positive"),
    "input_lower": (lambda a: changed(a, 3, 1e9), r"input_lower\[3\] is above the upper limit"),
    "input_upper": (lambda a: changed(a, 3, np.nan), r"input_upper\[3\] is no limit"),
    "l2": (lambda a: changed(a, 0, np.nan), r"l2\[0\] is not a finite number"),
    "constraint_limits": (lambda a: a[:-1], r"constraint_limits: expected 60 doubles \(15, 4\)"),
    "imposed": (lambda a: a.astype(float), r"imposed: expected 60 ints \(15, 4\)"),
}


@pytest.mark.parametrize("name", WRONG)
def test_one_wrong_thing(name, values):
    spoil, message = WRONG[name]
    with pytest.raises(ValueError, match=message):
        Core(0, values | {name: spoil(values[name])}, asdict(Settings()))


@pytest.mark.parametrize(
    ("name", "index", "value"),
    [
        ("equation", 1, 0),
        ("unknown", 0, 60),
        ("later", 0, 0),
        ("target", 0, 999),
        ("nonzero", 0, -1),
        ("entry", 3, 999),
    ],
)
def test_one_wrong_thing_of_sparse_factors(name, index, value):
    values = core_problem(rumo.RealTimeIteration(rod(60), backend="portable").transcription).values
    with pytest.raises(ValueError, match=rf"factor_{name}\[{index}\] is out of range"):
        Core(0, values | {f"factor_{name}": changed(values[f"factor_{name}"], index, value)}, asdict(Settings()))


def test_columns_of_substeps_come_in_order():
    transcription = rumo.RealTimeIteration(car()[0], rumo.Bdf2(substeps=2), backend="portable").transcription
    values = core_problem(transcription).values
    columns = changed(values["composition_column"], 1, values["composition_column"][0])
    with pytest.raises(ValueError, match=r"composition_column\[1\] comes out of order"):
        Core(0, values | {"composition_column": columns}, asdict(Settings()))


def test_wide_problems_are_condensed():
    values = core_problem(rumo.RealTimeIteration(rod(60), backend="portable").transcription).values
    with pytest.raises(ValueError, match="condensing is too small"):
        Core(0, values | {"condensing": 0}, asdict(Settings()))


def test_what_is_missing(values):
    with pytest.raises(ValueError, match="l1: is missing"):
        Core(0, {name: value for name, value in values.items() if name != "l1"}, asdict(Settings()))


def test_settings(values):
    core = Core(0, values, asdict(Settings()))
    with pytest.raises(ValueError, match="sqp_iterations is too small"):
        core.configure(asdict(replace(Settings(), sqp_iterations=0)))


def test_an_update_with_a_wrong_number_changes_nothing(values):
    core, other = (Core(0, values, asdict(Settings())) for _ in range(2))
    weights = 2.0 * values["output_weights"]
    with pytest.raises(ValueError, match=r"input_scales\[1\] is not positive"):
        core.update({"output_weights": weights, "input_scales": np.array([1.0, -1.0])})
    with pytest.raises(ValueError, match=r"output_weights: expected 60 doubles"):
        core.update({"output_weights": weights[0]})
    plans = [step(each) for each in (core, other)]
    np.testing.assert_array_equal(*plans)


def test_an_update_is_a_controller_made_anew(values):
    fresh = {"output_weights": 2.0 * values["output_weights"], "input_upper": 0.5 * values["input_upper"]}
    updated, made = Core(0, values, asdict(Settings())), Core(0, values | fresh, asdict(Settings()))
    updated.update(fresh)
    np.testing.assert_array_equal(step(updated), step(made))


def test_what_is_prepared_stays_so(values):
    """Bounds need no other preparation, weights get one; without any there is no feedback."""
    core = Core(0, values, asdict(Settings()), "before")
    step(core)
    assert step(core, core.feedback) is None
    core.prepare()
    core.update({"input_upper": 0.5 * values["input_upper"]}, "after")
    assert step(core, core.feedback) is not None
    core.prepare()
    core.update({"output_weights": 0.5 * values["output_weights"]})
    assert step(core, core.feedback) is not None


def test_a_step_says_with_which_numbers_it_was_made(values):
    core = Core(0, values, asdict(Settings()), "before")
    x, reference, numbers = told()
    assert core.step(x, reference, numbers)[0] == "before"
    with pytest.raises(ValueError, match="input_lower"):
        core.update({"input_upper": values["input_lower"] - 1.0}, "refused")
    assert core.step(x, reference, numbers)[0] == "before"
    core.update({"input_upper": 0.5 * values["input_upper"]}, "after")
    assert core.step(x, reference, numbers)[0] == "after"
    core.configure(asdict(Settings()), "configured")
    assert core.step(x, reference, numbers)[0] == "configured"


def told():
    problem, x, window = car()
    reference = np.ascontiguousarray(np.column_stack([np.broadcast_to(window[name], 16) for name in problem.outputs]))
    return np.array(x), reference, np.empty(15 * 2 + 16 * 9 + 15 * 4 + len(DIAGNOSTICS))


def step(core, function=None):
    """Numbers of a plan; None if there is none."""
    *given, numbers = told()
    if (function or core.step)(*given, numbers) is None:
        return None
    assert np.isfinite(numbers[:-4]).all()
    return numbers


def test_bounds_of_an_interval_are_the_solvers():
    problem = pendulum(horizon=10, delay=1)
    rti = rumo.RealTimeIteration(problem, backend="portable", sqp_iterations=30)
    description = core_problem(rti.transcription)
    upper = np.tile(problem.input_upper, (10, 1))
    upper[3:5] = 0.1
    settings = replace(Settings(), sqp_iterations=30)
    core = Core(0, description.values | {"input_upper": upper}, asdict(settings))
    numbers = np.empty(10 * 1 + 11 * 2 + len(DIAGNOSTICS))
    _, status, *_ = core.step(np.array([0.0, 0.0]), np.full((11, len(problem.outputs)), 0.8), numbers)
    assert status == 0
    u, x = numbers[:10].reshape(10, 1), numbers[10:32].reshape(11, 2)
    np.testing.assert_allclose(u[3:5], 0.1)
    assert (u[[2, 5]] > 0.2).all()
    # Inputs clipped afterwards would not lead to these states.
    inner, parameters = np.zeros((10, 0)), problem.parameters
    assert np.abs(rti.transcription.linearize(x, u, inner, parameters).defect).max() < 1e-9


def test_numbers_that_hold_on_all_intervals():
    sizes = {"horizon": 3, "inputs": 2, "constraints": 1}
    numbers = as_numbers(sizes, {"input_lower": [-1.0, -2.0], "constraint_limits": [0.5], "l1": [1.0]})
    np.testing.assert_array_equal(numbers["input_lower"], [[-1.0, -2.0]] * 3)
    np.testing.assert_array_equal(numbers["constraint_limits"], [[0.5]] * 3)
    np.testing.assert_array_equal(numbers["l1"], [1.0])
    assert set(numbers) == {"input_lower", "constraint_limits", "l1"}
