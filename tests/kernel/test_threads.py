"""Controllers in several threads: the core works without the interpreter's lock, and one controller is never in two."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from problems import pendulum, swinging_cart

import rumo


def recording(problem, x, steps):
    window = np.zeros((steps, problem.horizon + 1, len(problem.outputs)))
    return np.tile(x, (steps, 1)), window, np.zeros((steps, max(problem.delay, 1), len(problem.model.inputs)))


def test_one_thread_steps_while_another_is_in_the_core():
    problem, x, _ = swinging_cart()
    long, short = (rumo.RealTimeIteration(problem, backend="portable") for _ in range(2))
    reference = np.zeros((problem.horizon + 1, len(problem.outputs)))
    times = long.replay(*recording(problem, x, 200))[:, 1:].sum(axis=1)
    data = recording(problem, x, int(1.0 / times.mean()))  # a second's worth
    begin_and_end = []

    def replay():
        begin_and_end.append(time.perf_counter())
        long.replay(*data)
        begin_and_end.append(time.perf_counter())

    thread = threading.Thread(target=replay)
    thread.start()
    moments = []
    while thread.is_alive():
        short.step(x, reference)
        moments.append(time.perf_counter())
    thread.join()
    begin, end = begin_and_end
    # With the lock held, there would be none from some milliseconds after the beginning to the end.
    quarter = (end - begin) / 4.0
    assert sum(begin + quarter < moment < end - quarter for moment in moments) > 20


def test_threads_share_a_controller():
    problem, x, _ = swinging_cart()
    controller = rumo.RealTimeIteration(problem, backend="portable")
    reference = np.zeros((problem.horizon + 1, len(problem.outputs)))
    alone = rumo.RealTimeIteration(problem, backend="portable").step(x, reference)
    plans = []

    def work():
        plans.extend(controller.step(x, reference) for _ in range(300))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert controller.status_counts.total() == len(plans) == 1200
    assert all(np.isfinite(plan.u.values).all() for plan in plans)
    np.testing.assert_array_equal(plans[0].x.values[0], alone.x.values[0])


class Slow:
    """A core whose update gives another thread some time to get in between."""

    def __init__(self, core):
        self.core, self.begun, self.over = core, threading.Event(), threading.Event()

    def __getattr__(self, name):
        return getattr(self.core, name)

    def update(self, *values):
        self.begun.set()
        self.over.wait(0.02)
        self.core.update(*values)


def test_a_preparation_stays_one_while_another_thread_updates():
    controller = rumo.RealTimeIteration(pendulum(), backend="portable")
    x, reference = [0.1, 0.0], {"angle": 0.0}
    controller.step(x, reference)
    slow = controller._engine._core = Slow(controller._engine._core)
    thread = threading.Thread(target=lambda: controller.update(weights={"angle": 2.0}))
    thread.start()
    slow.begun.wait()
    controller.prepare()
    slow.over.set()
    thread.join()
    assert controller.feedback(x, reference).status.solved


def test_a_conflict_is_that_of_ones_own_step():
    # From one sample there is no way to respect the limits; the other has many that are active.
    problem = pendulum(horizon=40, bounds={"torque": (-1.0, 1.0), "angle": (-1.0, 1.0)})
    samples, reference = ([1.5, 0.0], [0.6, -0.4]), np.full((problem.horizon + 1, len(problem.outputs)), 0.9)

    def conflicts(controller, steps):
        return {(k % 2, controller.step(samples[k % 2], reference).conflict) for k in range(steps)}

    def controller():
        return rumo.RealTimeIteration(problem, backend="portable", gate=None)

    (_, expected), (_, none) = sorted(conflicts(controller(), 2))
    assert expected
    assert none == ()
    shared, found = controller(), []
    threads = [threading.Thread(target=lambda: found.append(conflicts(shared, 400))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {conflict for seen in found for which, conflict in seen if which == 0} == {expected}


BUSY = """
import os, signal, sys, threading, time
import numpy as np
import rumo
from rumo import ForkedError
from problems import pendulum

X, REFERENCE = [0.1, 0.0], {"angle": 0.0}
free, busy = (rumo.RealTimeIteration(pendulum(), backend=sys.argv[1]) for _ in range(2))
free.step(X, REFERENCE)
if sys.argv[1] == "portable":
    count = 300_000
    data = np.tile(X, (count, 1)), np.zeros((count, 13, 1)), np.zeros((count, 1, 1))
    work = lambda: busy._engine._core.replay(*data, np.zeros((count, 3)), count)
else:
    busy._engine.method.solve = lambda *_: time.sleep(60.0)
    work = lambda: busy.step(X, REFERENCE)
threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
child = os.fork()
if child == 0:
    signal.alarm(30)
    told = []
    for use in (lambda: busy.step(X, REFERENCE), busy.prepare, busy.reset, lambda: busy.update(weights={"angle": 2.0})):
        try:
            use()
        except ForkedError as error:
            told.append("spawn" in str(error))
    solved = [controller.step(X, REFERENCE).status.solved for controller in (free, rumo.RealTimeIteration(pendulum()))]
    os._exit(0 if all(solved) and told == [True] * 4 else 1)
code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
os._exit(code if code >= 0 else 2)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_a_fork_within_a_step_is_told_and_does_not_hang(backend):
    """In the child nobody is left to finish the step; controllers that nobody was in go on."""
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    command = [sys.executable, "-W", "ignore::DeprecationWarning", "-c", BUSY, backend]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
