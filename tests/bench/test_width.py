"""How a step grows with the number of states, and whether the rival solves the same problem."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from rumo.bench import measuring, width
from rumo.bench.rivals import CasadiSqp
from rumo.bench.width import FAMILIES, drive, exponent, width_report
from rumo.cli.app import app


@pytest.mark.parametrize("family", FAMILIES)
def test_the_rival_finds_the_commands_of_the_drive(family):
    recording = drive(FAMILIES[family], 12)
    scales = recording.problem.input_scales
    driven = recording.applied[:, -1] / scales
    assert np.ptp(driven) > 0.5  # it is a drive with something to do
    rival = CasadiSqp(recording.problem, "osqp", compiled=False, rho=10.0)
    commands = []
    for x, reference, applied in zip(recording.x, recording.reference, recording.applied, strict=True):
        rival.applied = applied
        rival.prepare()
        commands.append(rival.feedback(x, reference) / scales)
    np.testing.assert_allclose(commands[:-1], driven[1:], rtol=0.0, atol=1e-2)  # OSQP stops at 1e-3


def test_exponents_are_those_of_powers():
    widths = np.array([10.0, 20.0, 40.0])
    assert exponent(widths, 3.0 * widths**1.5) == pytest.approx(1.5)


def test_the_command_tells_times_by_width(monkeypatch):
    for name in ("ROUNDS", "LAPS"):
        monkeypatch.setattr(measuring, name, 1)
    rods = dataclasses.replace(FAMILIES["heat-rod"], widths=(2, 4), rivals=("rti-python",))
    monkeypatch.setattr(width, "FAMILIES", {"heat-rod": rods})
    monkeypatch.setattr(width, "STEPS", 24)
    outcome = CliRunner().invoke(app, ["bench", "--width", "--json", "--quiet"])
    assert outcome.exit_code == 0, outcome.output
    content = json.loads(outcome.stdout)
    assert [run["width"] for run in content["runs"]] == [2, 4]
    assert set(content["exponents"]["heat-rod"]) == {"rti", "rti-python"}
    table = width_report(content["runs"]).sections[0].content[0]
    assert [row[0] for row in table.rows] == ["2", "4", "exponent"]
    assert max(len("  ".join(row)) for row in table.rows) <= 80
