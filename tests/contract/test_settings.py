"""Settings are frozen, checked, changed as a whole, and obeyed from the next call on by every engine."""

import copy
import pickle
from dataclasses import FrozenInstanceError, replace
from threading import Thread
from time import sleep

import numpy as np
import pytest
from problems import pendulum, swinging_cart

import rumo
from rumo import InnovationGate, NlpSettings, QpOptions, Settings, Status
from rumo.controllers import base
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.trajectory import Trajectory
from rumo.transcription import Transcription

BACKENDS = ("portable", "reference")
every_backend = pytest.mark.parametrize("backend", BACKENDS)
REFERENCE = {"angle": 0.5}


@every_backend
def test_iterations_are_obeyed_at_once(backend):
    problem, x, reference = swinging_cart()
    once, often = (rumo.RealTimeIteration(problem, backend=backend, sqp_iterations=n) for n in (1, 10))
    expected = often.step(x, reference).u.values
    assert not np.allclose(once.step(x, reference).u.values, expected, atol=1e-6)
    once.reset()
    once.configure(sqp_iterations=10)
    np.testing.assert_array_equal(once.step(x, reference).u.values, expected)


@every_backend
def test_the_gate_is_obeyed_at_once(backend):
    controller = rumo.RealTimeIteration(pendulum(), backend=backend)
    controller.step([0.0, 0.0], REFERENCE)
    assert controller.step([1e6, 0.0], REFERENCE).status is Status.BAD_MEASUREMENT
    controller.configure(gate=None)
    assert controller.step([1e6, 0.0], REFERENCE).status is not Status.BAD_MEASUREMENT
    controller.settings = replace(controller.settings, gate=InnovationGate())
    controller.reset()
    controller.step([0.0, 0.0], REFERENCE)
    assert controller.step([1e6, 0.0], REFERENCE).status is Status.BAD_MEASUREMENT


@every_backend
def test_limits_of_the_qp_are_obeyed_at_once(backend):
    controller = rumo.RealTimeIteration(pendulum(), backend=backend)
    controller.step([0.0, 0.0], {"angle": 30.0})
    controller.configure(qp=QpOptions(max_iterations=0))
    assert controller.step([0.1, 0.0], {"angle": -30.0}).cause is Status.BUDGET_EXCEEDED


@every_backend
def test_the_integrator_tolerance_is_obeyed_at_once(backend):
    problem, x, reference = swinging_cart()
    controller = rumo.RealTimeIteration(problem, backend=backend)
    controller.step(x, reference)
    controller.configure(integrator_tolerance=0.0)
    assert not controller.step(x, reference).diagnostics.integrated
    controller.configure(integrator_tolerance=np.inf)
    assert controller.step(x, reference).diagnostics.integrated


def test_limits_of_ipopt_are_obeyed_at_once():
    problem, x, reference = swinging_cart()
    controller = rumo.DirectNlp(problem)
    controller.step(x, reference)
    controller.configure(max_iterations=0)
    assert controller.step(x, reference).cause is Status.BUDGET_EXCEEDED


def test_a_constructor_takes_settings_and_changes():
    base = Settings(sqp_iterations=3)
    controller = rumo.RealTimeIteration(pendulum(), settings=base, tolerance=1e-3)
    assert controller.settings == Settings(sqp_iterations=3, tolerance=1e-3)
    assert rumo.DirectNlp(pendulum(), tolerance=1e-4).settings == NlpSettings(tolerance=1e-4)


@pytest.mark.parametrize("name", ["sqp_iterations", "gate", "qp", "tolerance"])
def test_settings_are_no_attributes(name):
    controller = rumo.RealTimeIteration(pendulum())
    with pytest.raises(AttributeError, match=f"configure\\({name}=None\\)"):
        setattr(controller, name, None)
    with pytest.raises(FrozenInstanceError):
        setattr(controller.settings, name, None)


def test_unknown_attributes_and_settings_are_refused():
    controller = rumo.RealTimeIteration(pendulum())
    with pytest.raises(rumo.RumoError, match="Did you mean 'applied'"):
        controller.aplied = 1.0
    with pytest.raises(rumo.UnknownNameError, match="Did you mean 'sqp_iterations'"):
        controller.configure(sqp_iteration=2)
    with pytest.raises(rumo.ArgumentError, match="settings: got NlpSettings"):
        controller.settings = NlpSettings()


def test_nothing_changes_if_a_value_cannot_work():
    controller = rumo.RealTimeIteration(pendulum())
    before = controller.settings
    with pytest.raises(rumo.ArgumentError, match="sqp_iterations: got 0"):
        controller.configure(gate=None, sqp_iterations=0)
    assert controller.settings is before


class Bang(Method):
    """The input that pushes towards the reference, as hard as it may."""

    def __init__(self, problem: rumo.Problem) -> None:
        self.transcription = Transcription(problem)

    def solve(self, x, window, guess, applied):
        problem = self.transcription.problem
        u = np.where(window["angle"][:1] > x[0], problem.input_upper, problem.input_lower)
        trajectory = Trajectory(np.tile(u, (problem.horizon, 1)), guess.x, guess.inner)
        return Candidate(trajectory, np.zeros((problem.horizon, len(problem.constraints))), Status.OPTIMAL)


class BangBang(rumo.Controller[rumo.ControllerSettings]):
    name = "bang"

    def __init__(self, problem: rumo.Problem, eagerness: float = 1.0) -> None:
        method, settings = Bang(problem), rumo.ControllerSettings()
        super().__init__(method.transcription, Guarded(method, settings), settings)
        self.eagerness = eagerness


def test_a_controller_of_ones_own():
    controller = BangBang(pendulum(), 2.0)
    assert controller.step([0.0, 0.0], REFERENCE).command["torque"] == 2.0
    assert controller.step([1.0, 0.0], REFERENCE).command["torque"] == -2.0
    assert controller.step([np.nan, 0.0], REFERENCE).status is Status.BAD_MEASUREMENT
    log = rumo.simulate(controller, controller.problem.model, [0.0, 0.0], REFERENCE, duration=0.5)
    assert log.attrs["controller"] == "bang"
    controller.eagerness = 3.0
    with pytest.raises(AttributeError, match="Did you mean 'eagerness'"):
        controller.eagernes = 3.0


class Counting(rumo.RealTimeIteration):
    """A subclass that does something besides."""

    name = "counting"

    def __init__(self, problem: rumo.Problem) -> None:
        super().__init__(problem, sqp_iterations=2)
        self.steps = 0

    def step(self, x, reference):
        self.steps += 1
        return super().step(x, reference)


def test_what_a_method_refuses_changes_nothing(monkeypatch):
    def refuse(*_):
        raise ValueError("not mine")

    controller = BangBang(pendulum())
    controller.step([0.0, 0.0], REFERENCE)
    for name in ("configure", "update"):
        monkeypatch.setattr(Bang, name, refuse)
    with pytest.raises(ValueError, match="not mine"):
        controller.configure(gate=None)
    with pytest.raises(ValueError, match="not mine"):
        controller.update(bounds={"torque": (-0.1, 0.1)})
    assert controller.step([1e6, 0.0], REFERENCE).status is not Status.BAD_MEASUREMENT  # nothing has a reach here
    assert abs(controller.step([0.0, 0.0], REFERENCE).command["torque"]) == 2.0
    assert controller.problem.numbers.input_upper.max() == 2.0


def test_a_controller_is_not_copied():
    controller = BangBang(pendulum())
    for copied in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="Make another one of its problem and settings"):
            copied(controller)


def test_changes_that_there_are_not_raise_with_a_hint():
    controller = BangBang(pendulum())
    with pytest.raises(rumo.UnknownNameError, match="Did you mean 'weights'"):
        controller.update(weight={"angle": 2.0})
    with pytest.raises(AttributeError, match=r"BangBang\.problem cannot be set"):
        controller.problem = pendulum()


def test_a_subclass_of_the_real_time_iteration():
    controller = Counting(pendulum())
    assert controller.step([0.0, 0.0], REFERENCE).status is Status.OPTIMAL
    assert (controller.steps, controller.settings.sqp_iterations) == (1, 2)
    assert repr(controller).startswith("Counting(Problem(pendulum")


def together(*calls):
    """Each in a thread of its own."""
    threads = [Thread(target=call) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


@pytest.mark.parametrize("make", [rumo.RealTimeIteration, rumo.DirectNlp])
def test_threads_that_change_a_controller_lose_no_change(make, monkeypatch):
    def slow(function):
        def call(*arguments, **named):
            made = function(*arguments, **named)
            sleep(0.002)
            return made

        return call

    controller = make(pendulum())
    monkeypatch.setattr(rumo.Problem, "changed", slow(rumo.Problem.changed))
    monkeypatch.setattr(base, "changed", slow(base.changed))
    together(
        lambda: controller.update(weights={"angle": 2.0}),
        lambda: controller.update(weights={"torque": 3.0}),
        lambda: controller.configure(gate=None),
        lambda: controller.configure(tolerance=1e-6),
    )
    numbers = controller.problem.numbers
    assert (numbers.tracking[0, 0], numbers.moving[0, 0]) == (2.0, 3.0)
    assert (controller.settings.gate, controller.settings.tolerance) == (None, 1e-6)


def test_a_plan_has_the_numbers_it_was_made_with_whichever_thread_changes_them():
    controller, plans = rumo.RealTimeIteration(pendulum(), backend="portable", gate=None), []
    limits = np.linspace(0.1, 1.0, 150).tolist()
    done = []

    def drive():
        while not done:
            plans.append(controller.step(np.zeros(2), np.full((13, 1), 50.0)))

    def change():
        for limit in limits:
            controller.update(bounds={"torque": (-limit, limit)})
        done.append(True)

    together(drive, change)
    assert len({plan.problem.input_upper[0] for plan in plans}) > 5
    used, named = np.array([(plan.command["torque"], plan.problem.input_upper[0]) for plan in plans]).T
    np.testing.assert_allclose(used, named, rtol=1e-9)


def test_what_is_applied_is_set_between_steps():
    controller, applied = rumo.DirectNlp(pendulum()), [[1.2345]]
    controller.step([0.9, 0.0], REFERENCE)

    def correct():
        sleep(2e-3)  # within the other's step
        controller.applied = applied

    for _ in range(3):
        controller.reset()
        together(lambda: controller.step([0.9, 0.0], REFERENCE), correct)
        assert controller.applied.tolist() == applied


def test_threads_that_share_a_controller_in_python_wait_for_each_other():
    controller = rumo.DirectNlp(pendulum())
    plans = []

    def drive():
        plans.extend(controller.step([0.1, 0.0], REFERENCE) for _ in range(20))

    together(drive, drive, drive)
    assert len(plans) == controller.status_counts.total() == 60
    assert {plan.status for plan in plans} == {Status.OPTIMAL}


@pytest.mark.parametrize(
    "change",
    [
        lambda n: Settings(sqp_iterations=n),
        lambda n: Settings(preparation_iterations=n),
        lambda n: QpOptions(max_iterations=n),
        lambda n: InnovationGate(patience=n),
    ],
)
def test_whole_numbers_are_those_that_the_core_takes(change):
    change(2**31 - 1)
    with pytest.raises(rumo.ArgumentError, match="got 2147483648, expected a whole number of at most 2147483647"):
        change(2**31)


def test_settings_of_another_kind_are_refused_and_change_nothing():
    with pytest.raises(rumo.ArgumentError, match=r"expected rumo.LtvSettings\(...\)"):
        rumo.LinearTimeVarying(pendulum(), settings=Settings(sqp_iterations=10))
    with pytest.raises(rumo.ArgumentError, match="settings: got None"):
        rumo.RealTimeIteration(pendulum(), settings=None)
    with pytest.raises(rumo.ArgumentError, match=r"expected rumo.Settings\(...\). Write rumo.Settings\(\*\*settings\)"):
        rumo.RealTimeIteration(pendulum(), settings={"sqp_iterations": 3})
    ltv = rumo.LinearTimeVarying(pendulum())
    with pytest.raises(rumo.ArgumentError, match=r"expected rumo.LtvSettings\(...\)"):
        ltv.settings = Settings()
    controller = rumo.DirectNlp(pendulum())
    with pytest.raises(rumo.ArgumentError, match="max_iterations: got 1000000000000, expected a whole number"):
        controller.configure(max_iterations=10**12)
    assert controller.settings == NlpSettings()
    assert controller.step([0.0, 0.0], REFERENCE).status is Status.OPTIMAL


def test_the_integrator_residual_of_ltv_is_judged():
    problem, x, _ = swinging_cart()
    window = dict(zip(problem.model.states, x, strict=True))
    controller = rumo.LinearTimeVarying(problem)
    diagnostics = controller.step(x, window | dict.fromkeys(problem.outputs, 0.0)).diagnostics
    assert diagnostics.integrated == (diagnostics.integrator_residual <= 0.01)


@pytest.mark.parametrize("make", [rumo.RealTimeIteration, rumo.DirectNlp])
def test_a_reference_that_nobody_uses_may_be_nothing(make):
    assert make(pendulum()).step([0.0, 0.0], {"angle": 0.1, "rate": np.nan}).status is Status.OPTIMAL
