"""The study of discretisation schemes measures what it says, and finds what theory says."""

import json
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.registry import DISCRETIZATIONS
from rumo.studies.discretization import DiscretizationStudy, one_case
from rumo.studies.discretization.cases import CASES
from rumo.studies.discretization.charts import LOOKS
from rumo.studies.discretization.one_mode import damping
from rumo.studies.discretization.prediction import ReferenceSolution
from rumo.studies.discretization.report import find, findings
from rumo.studies.discretization.summary import LABELS
from rumo.studies.discretization.tables import cheapest, order_table, outcome_table, properties_table

SCHEMES = ("implicit-euler", "trapezoidal", "radau2", "rk4")


DURATIONS = {"robertson": 32.0, "van-de-vusse": 1920.0}


@pytest.fixture(scope="module", autouse=True)
def short():
    """Short drives, and one round of replays: RK4 needs thousands of substeps in each interval of Robertson's."""
    with pytest.MonkeyPatch.context() as patch:
        for name, duration in DURATIONS.items():
            patch.setitem(CASES, name, lambda make=CASES[name], duration=duration: replace(make(), duration=duration))
        patch.setattr(one_case, "ROUNDS", 1)
        patch.setattr(one_case, "LAPS", 1)
        yield


@pytest.fixture(scope="module")
def study():
    return DiscretizationStudy(tuple(DURATIONS), SCHEMES, backend="portable")


@pytest.fixture(scope="module")
def results(study):
    return study.run()


@pytest.fixture(scope="module")
def content(study, results):
    return study.summary(results)


@pytest.mark.parametrize("name", CASES)
def test_the_reference_solution_is_that_of_another_integrator(name):
    case = CASES[name]()
    solution, longest = ReferenceSolution(case), max(case.steps)
    model, p = case.model, case.model.default_parameters
    rates = ca.Function("rates", [model.x, model.u], [model.f(model.x, model.u, p)])
    jacobian, x = model.jacobian(), solution.x[0]
    for k in range(case.intervals(longest)):
        u = case.inputs(k * longest)
        x = solve_ivp(
            lambda t, x, u=u: rates(x, u).full().ravel(),
            (0.0, longest),
            x,
            "Radau",
            rtol=1e-10,
            atol=1e-13,
            jac=lambda t, x, u=u: jacobian(x, u, p).full(),
        ).y[:, -1]
        scale = np.ptp(solution.x, axis=0) + 1e-9
        assert (np.abs(x - solution.x[k + 1]) <= 1e-6 * scale).all()
    assert 0.0 < solution.floor < 1e-8 * solution.span


def test_errors_do_not_depend_on_how_steps_are_divided_into_intervals_and_substeps():
    solution = ReferenceSolution(CASES["van-de-vusse"]())
    for name in ("implicit-euler", "rk4"):
        whole = solution.accuracy(DISCRETIZATIONS[name](), 60.0)
        divided = solution.accuracy(DISCRETIZATIONS[name](substeps=4), 240.0)
        assert divided.outputs == pytest.approx(whole.outputs, rel=1e-9)
        assert divided.perturbation_left == pytest.approx(whole.perturbation_left, rel=1e-5)


def test_errors_fall_with_the_declared_order(content):
    """On the reactor at its two shortest steps, where the leading term rules."""
    case = content["cases"]["van-de-vusse"]
    for name in ("implicit-euler", "trapezoidal", "radau2"):
        coarse, fine = (find(case, name, step)["error"] for step in (60.0, 30.0))
        assert np.log2(coarse / fine) == pytest.approx(DISCRETIZATIONS[name].order, abs=0.3)


def test_only_l_stable_schemes_forget_a_perturbation(content):
    for outcome in content["cases"]["robertson"]["outcomes"]:
        if outcome["scheme"] == "trapezoidal":
            assert outcome["perturbation_left"] > 0.9
        else:
            assert outcome["perturbation_left"] < 1e-4


def test_explicit_schemes_get_as_many_substeps_as_are_stable(results):
    result = results["robertson"]
    step = result.stable_steps["rk4"]
    assert set(result.stable_steps) == {"rk4"}
    # All modes are real there, and RK4 is stable up to 2.785 on the real axis.
    assert result.rate * step == pytest.approx(2.785293563405282, rel=1e-5)
    for outcome in result.outcomes:
        assert outcome.substeps == (np.ceil(outcome.step / step - 1e-9) if outcome.scheme == "rk4" else 1)
        assert set(outcome.statuses) == {"OPTIMAL"}
    # With a tenth fewer, the prediction is lost.
    assert not result.errors_beyond["rk4"] < 0.1


def test_times_are_those_of_the_phases(content):
    for outcome in content["cases"]["robertson"]["outcomes"]:
        assert 0.0 < outcome["linearize_us"] <= outcome["prepare_us"]
        assert outcome["total_us"] == pytest.approx(outcome["prepare_us"] + outcome["feedback_us"])
    assert content["cases"]["robertson"]["backend"] == "portable"
    assert content["machine"]["processor"]


def test_the_closed_loop_is_the_problems(results):
    case = CASES["robertson"]()
    outcome = next(o for o in results["robertson"].outcomes if (o.scheme, o.step) == ("radau2", 4.0))
    problem = case.problem(4.0)
    controller = rumo.RealTimeIteration(problem, rumo.Radau2(), backend="reference")
    log = rumo.simulate(controller, problem.model, case.start, case.reference, case.duration)
    distance = log.plant.sel(plant_state="a").values - log.reference.sel(output="a").values
    settled = distance[len(distance) // 4 :]
    assert outcome.rms == pytest.approx(np.sqrt(np.mean(settled**2)), rel=1e-4)


def test_the_cheapest_is_solved_and_damps_and_is_good_enough():
    def outcome(us, error, left=0.0, status="OPTIMAL"):
        return {"total_us": us, "error": error, "perturbation_left": left, "status_counts": {status: 3}}

    good = outcome(5.0, 0.02)
    bad = [
        outcome(1.0, None, None),
        outcome(1.0, 0.03),
        outcome(2.0, 0.01, left=0.5),
        outcome(3.0, 0.01, status="SOLVER_FAILED"),
    ]
    case = {"span": 2.0, "outcomes": [*bad, outcome(6.0, 0.001, status="SOFT_VIOLATED"), good]}
    assert cheapest(case, 0.01) is good
    assert cheapest(case, 0.001)["total_us"] == 6.0
    assert cheapest(case, 1e-4) is None


def test_every_scheme_has_a_name_and_a_look_of_its_own():
    assert set(LABELS) == set(LOOKS) == set(DISCRETIZATIONS)
    assert len(set(LABELS.values())) == len({(look.color, look.dash, look.marker) for look in LOOKS.values()}) == 10


def test_tables_and_sentences_show_the_summary(content):
    case = content["cases"]["robertson"]
    table = outcome_table(case, content["schemes"])
    assert len(table.rows) == len(SCHEMES) * 4
    rk4 = find(case, "rk4", 2.0)
    assert any(f"RK4 needs {rk4['substeps']:,} substeps" in sentence for sentence in findings(content))
    rows = {row[0]: row for row in properties_table(content).rows}
    assert rows["Trapezoidal"][1:5] == ["2", "yes", "no", "1"]
    orders = {row[0]: row[1:4] for row in order_table(content).rows}
    assert orders["Radau2"] == ["3", "3.0", "2.0"]  # a fast mode is followed with less: h^2 / rate
    assert orders["RK4"] == ["4", "4.0", "-"]
    assert rows["Radau2"][5:] == ["any", "any"]
    assert rows["RK4"][5].endswith(" us")
    assert rows["RK4"][6].endswith(" s")


def test_damping_in_closed_form():
    left = damping(("implicit-euler", "gauss2"), np.array([-1.0, -1e6]))
    np.testing.assert_allclose(left["implicit-euler"], [0.5, 1.0 / (1.0 + 1e6)])
    assert left["gauss2"][1] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cases": ("car",)}, "cases: got 'car', expected one of car-2, car-5, car-10, car-15, van-der-pol,"),
        ({"schemes": ("radau",)}, "Did you mean 'radau3'?"),
        ({"schemes": ()}, "schemes: got none, expected some of implicit-euler,"),
        ({"backend": "reference"}, "backend: got 'reference', expected one of auto, tailored, portable."),
    ],
)
def test_bad_settings(changes, message):
    with pytest.raises(rumo.ArgumentError) as error:
        DiscretizationStudy(**changes)
    assert message in str(error.value)


def test_a_backend_without_a_clock_is_refused(monkeypatch):
    monkeypatch.setenv("RUMO_BACKEND", "reference")
    with pytest.raises(rumo.ArgumentError, match="Unset RUMO_BACKEND, or choose one"):
        DiscretizationStudy(("van-der-pol",), ("radau2",))


def test_command(tmp_path):
    arguments = ["--cases", "van-de-vusse", "--schemes", "implicit-euler,radau2", "--backend", "portable"]
    run = CliRunner().invoke(app, ["study", "discretization", *arguments, "--output", str(tmp_path)])
    assert run.exit_code == 0, run.output
    content = json.loads((tmp_path / "summary.json").read_text())
    assert [o["scheme"] for o in content["cases"]["van-de-vusse"]["outcomes"]] == 4 * ["implicit-euler"] + 4 * [
        "radau2"
    ]
    assert "Radau2" in (tmp_path / "report.html").read_text()
    for figure in ("work-precision", "error-step", "closed-loop", "damping", "order"):
        assert (tmp_path / f"{figure}.png").stat().st_size > 10_000
