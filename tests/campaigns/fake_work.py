"""Work for engines, in place of drives: `behave` does what a task's setting `how` says."""

import ctypes
import os
import signal
import sys
import time
from pathlib import Path


def task(number, how="quick", controller="rti", **settings):
    return {
        "key": f"{how}-{number}-{controller}",
        "draw": number,
        "controller": controller,
        "settings": {"how": how, **settings},
    }


class Tasks:
    """So many tasks, made one by one."""

    def __init__(self, count, how=lambda number: "quick"):
        self._count, self._how = count, how

    def __len__(self):
        return self._count

    def __iter__(self):
        return (task(number, self._how(number), x=0.5 * number) for number in range(self._count))

    def __contains__(self, other):
        return other in list(self)


def behave(common, task):
    settings = task["settings"]
    found = BEHAVIOURS[settings["how"]](common, task)
    return {"kpi.double": 2.0 * settings.get("x", 0), "ended": None, **(found or {})}


def first_time(common, task):
    """Whether this run was not made before."""
    try:
        (Path(common["folder"]) / task["key"]).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def kill_once(common, task):
    if first_time(common, task):
        os.kill(os.getpid(), signal.SIGKILL)


def segfault(common, task):
    print("about to fail")
    ctypes.string_at(0)


def hang_with_the_gil(common, task):
    ctypes.PyDLL(None).sleep(60)


def hang(common, task):
    while True:
        pass


def deep(common, task):
    return deep(common, task)


def noisy(common, task):
    print("x" * 100_000)
    sys.stdout.flush()
    os.write(1, b"y" * 100_000)
    os.write(2, b"z" * 100_000)
    os.system("echo from another process")


def note(common, task):
    """Keep in a file who has made this run, and when."""
    with (Path(common["folder"]) / "made").open("a") as file:
        file.write(f"{task['key']} {os.getpid()}\n")


def wait_for_rows(common, task):
    """End as soon as rows of others are stored."""
    deadline = time.monotonic() + 10.0
    while not (parts := [*Path(common["campaign"]).glob("rows/*.parquet")]) and time.monotonic() < deadline:
        time.sleep(0.01)
    return {"kpi.parts": len(parts)}


def raise_with_a_log(common, task):
    error = ValueError("lost\nthe way")
    error.row = {"log": b"so far", "kpi.double": 1.0}
    raise error


def use_up_memory(common, task):
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))
    return {"kpi.length": len(bytearray(2**31))}


def changed(common, task):
    from rumo.campaigns.tasks.task import ChangedError

    raise ChangedError("scenario", "another file", "the file that it began with")


BEHAVIOURS = {
    "quick": lambda common, task: None,
    "raise": raise_with_a_log,
    "leave": lambda common, task: sys.exit(4),
    "exit": lambda common, task: os._exit(3),
    "segfault": segfault,
    "killed once": kill_once,
    "hang": hang,
    "hang with the GIL": hang_with_the_gil,
    "never end": lambda common, task: time.sleep(60),
    "sleep": lambda common, task: time.sleep(common.get("sleep", 0.01)),
    "interrupted": lambda common, task: os.kill(os.getpid(), signal.SIGINT),
    "deep": deep,
    "noisy": noisy,
    "huge": lambda common, task: {"log": bytes(30_000_000)},
    "no plain data": lambda common, task: {"kpi.what": object()},
    "use up memory": use_up_memory,
    "note": note,
    "wait for rows": wait_for_rows,
    "changed": changed,
    "log": lambda common, task: {"log": b"all of it", "kpi.asked": task.get("log") is not False},
    "threads": lambda common, task: {"threads": os.environ["OMP_NUM_THREADS"], "cwd": sys.path[0]},
}


def prepare(common):
    time.sleep(common.get("preparation", 0.0))
    if common.get("broken"):
        raise ValueError("cannot be set up")
    if common.get("crashing"):
        os._exit(7)
    if common.get("hanging"):
        hang_with_the_gil(common, None)


MIXED = {"timeout": 20.0, "sleep": 0.02}


def mixed_tasks(count):
    """Mostly runs that take a while; one raises, one crashes."""
    return Tasks(count, lambda number: {11: "raise", 17: "segfault"}.get(number, "sleep"))
