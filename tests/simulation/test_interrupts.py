"""Ctrl-C at any moment is a KeyboardInterrupt: no error of the plant, no failed step, no lost signal."""

import math
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from problems import pendulum

import rumo
from rumo.interrupts import Interrupted, interruptible

SCRIPT = Path(__file__).with_name("interrupted.py")
posix = pytest.mark.skipif(os.name == "nt", reason="processes are not sent SIGINT on Windows")


@posix
@pytest.mark.parametrize(
    ("name", "trials"),
    [("rti", 8), ("nlp", 3), *(pytest.param(name, 60, marks=pytest.mark.slow) for name in ("rti", "nlp"))],
)
def test_at_random_times(name, trials):
    result = subprocess.run([sys.executable, SCRIPT, name, str(trials)], capture_output=True, text=True, timeout=300)
    assert not result.stderr
    assert result.stdout.count("interrupted") == trials
    assert result.stdout.count("after") > trials // 2


def interrupt():
    os.kill(os.getpid(), signal.SIGINT)


@interruptible()
def interrupted(*then):
    """What a block does after a signal came in it."""
    interrupt()
    for action in then:
        action()


def fail():
    raise RuntimeError("CasADi's own")


@posix
def test_kept_until_the_block_ends():
    done = []
    with pytest.raises(KeyboardInterrupt):
        interrupted(lambda: done.append("after the signal"))
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@posix
def test_raised_instead_of_what_the_block_raises():
    with pytest.raises(KeyboardInterrupt):
        interrupted(fail)


@posix
def test_twice_is_at_once():
    done = []
    with pytest.raises(KeyboardInterrupt):
        interrupted(interrupt, lambda: done.append("not here"))
    assert not done


@posix
@pytest.mark.parametrize("own", [None, Interrupted("a log")])
def test_nothing_waits_without_patience_and_nothing_is_swallowed(own):
    done = []

    @interruptible(0)
    def swallowing():
        try:
            interrupt()
            done.append("not here")
        except KeyboardInterrupt:
            if own is not None:
                raise own from None
            done.append("as if it were an error of one's own")

    with pytest.raises(KeyboardInterrupt) as caught:
        swallowing()
    assert done == ([] if own else ["as if it were an error of one's own"])
    assert own is None or caught.value is own


@posix
def test_with_all_patience_nothing_breaks_it_off():
    done = []
    with pytest.raises(KeyboardInterrupt):
        interruptible(math.inf)(lambda: done.extend([interrupt(), interrupt(), "written"]))()
    assert done[-1] == "written"


@posix
def test_the_end_of_the_outer_block_counts():
    done = []

    @interruptible()
    def outer():
        interrupted()
        done.append("after the inner block")

    with pytest.raises(KeyboardInterrupt):
        outer()
    assert done


@posix
def test_other_handlers_are_called_and_stay():
    calls = []
    before = signal.signal(signal.SIGINT, lambda *_: calls.append("mine"))
    try:
        mine = signal.getsignal(signal.SIGINT)
        with interruptible():
            interrupt()
            assert not calls
        assert calls == ["mine"]
        assert signal.getsignal(signal.SIGINT) is mine
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with interruptible():
            interrupt()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_are_left_alone():
    found = []

    def work():
        with interruptible():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]


@posix
def test_the_log_so_far_comes_with_it():
    def progress(done, _):
        if done == 7:
            interrupt()

    problem = pendulum()
    with pytest.raises(Interrupted) as caught:
        rumo.simulate(
            rumo.RealTimeIteration(problem), problem.model, [0.3, 0.0], {"angle": 0.0}, 1.0, progress=progress
        )
    assert caught.value.log.sizes["time"] == 7
