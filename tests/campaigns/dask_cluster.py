"""A Dask cluster as users start it, on this machine alone."""

import json
import os
import subprocess
import sys
import time
from contextlib import suppress

import fake_work

ENVIRONMENT = os.environ | {"PYTHONPATH": os.path.dirname(fake_work.__file__)}


class Cluster:
    """A scheduler and workers as `dask scheduler` and `dask worker` start them, on this machine alone."""

    def __init__(self, stack, folder):
        self._stack, self._file = stack, folder / "scheduler.json"
        self.address, self.scheduler, self.workers = "", None, []

    def start(self, workers):
        self._file.unlink(missing_ok=True)
        place = ["--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0"]
        self.scheduler = self._dask("scheduler", *place, "--scheduler-file", self._file)
        while not (self._file.exists() and self._file.read_text().rstrip().endswith("}")):
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]
        for _ in range(workers):
            self.add_worker()

    def add_worker(self):
        place = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--nthreads", "1", "--no-nanny"]
        folder = self._file.with_name(f"worker-{len(self.workers)}")
        self.workers.append(self._dask("worker", self.address, *place, "--local-directory", folder))

    def _dask(self, kind, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, arguments)]
        process = subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._stack.callback(end, process)
        return process


def end(process):
    with suppress(ProcessLookupError):
        process.kill()
    process.wait()
