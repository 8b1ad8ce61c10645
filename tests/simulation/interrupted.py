"""Drives in a process of their own, each interrupted at a random time: says how long each had been."""

import os
import random
import signal
import sys
from dataclasses import replace
from threading import Timer

from rumo.interrupts import Interrupted
from rumo.registry import CONTROLLERS
from rumo.studies import PaperStudy
from rumo.studies.paper import kalman_filter

name, trials = sys.argv[1], int(sys.argv[2])
random.seed(0)
study = replace(PaperStudy((name,), duration=240.0), estimator=kalman_filter())
problem, plant = study.problem(), study.plant()
controller = CONTROLLERS[name](problem)
for _ in range(trials):
    timer = Timer(random.uniform(0.0, 0.8), os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        study.scenario(name, problem, plant).run(controller)
    except Interrupted as interrupt:
        log = interrupt.log
        assert log["plant"].notnull().all()
        assert not {"BUDGET_EXCEEDED", "SOLVER_FAILED"} & set(log["status"].data)
        print("interrupted after", log.sizes["time"])
    except KeyboardInterrupt:
        print("interrupted before the first sample")
