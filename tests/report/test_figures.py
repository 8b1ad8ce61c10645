"""Figures: complete, labelled with units, told apart without colours."""

import re
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.report.charts import NEUTRAL, Axis, Chart, HeatMap, Line, Panels
from rumo.report.figures import draw
from rumo.report.plots import narrow_layout, plot
from rumo.simulation.faults import Missing, Stuck
from rumo.simulation.recorder import Recorder
from rumo.studies import PaperStudy
from rumo.studies.kpis import driving_kpis
from rumo.studies.paper.charts import paper_charts


@pytest.fixture(scope="module")
def charts():
    return paper_charts(PaperStudy(("rti", "nlp", "ltv"), duration=0.4).run())


def test_the_papers_figures_are_there(charts):
    assert [chart.key for chart in charts] == [
        "trajectory-first-2s",
        "trajectory",
        "wind",
        "torque",
        "steering-rate",
        "tracking-error",
        "difference",
        "step-time-rti",
        "step-time-nlp",
        "step-time-ltv",
    ]


def test_the_licence_covers_what_pages_contain():
    root = Path(__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    assert project["license"] == "BSD-3-Clause AND MIT"
    assert any("Plotly" in (root / path).read_text() for path in project["license-files"])


def test_axes_have_units_and_lines_differ_in_more_than_colour(charts):
    for chart in charts:
        if isinstance(chart, Panels):
            assert all(re.search(r"\[.+\]$", title) for title, _ in chart.panels)
            continue
        assert re.search(r"\[.+\]$", chart.x_label), chart.key
        assert re.search(r"\[.+\]$", chart.y_label) or chart.y_label == "Steps", chart.key
        looks = [(line.look.dash, line.look.width) for line in chart.lines]
        assert len(set(looks)) == len(looks), chart.key


def test_print_and_page_show_the_same(charts):
    for chart in (chart for chart in charts if isinstance(chart, Chart)):
        printed, interactive = draw(chart).axes[0], plot(chart)
        if chart.histogram is not None:
            counts = [patch.get_height() for patch in printed.patches]
            np.testing.assert_array_equal(counts, interactive.data[0].y)
            assert sum(counts) == 10  # every step is in some bin
            assert chart.markers == ((40.0, "Sampling period, 40 ms"),)
            continue
        assert len(printed.lines) == len(interactive.data) == len(chart.lines)
        for line, trace, source in zip(printed.lines, interactive.data, chart.lines, strict=True):
            np.testing.assert_array_equal(line.get_ydata(), source.y)
            np.testing.assert_array_equal(trace.y, source.y)


def test_a_panel_alone_has_all_the_width():
    line = Line("a", np.arange(3.0), np.arange(3.0), NEUTRAL)
    one, three = (Panels("key", "Title", "x [1]", "y [1]", n * (("Panel", (line,)),)) for n in (1, 3))
    assert (one.columns, one.rows, three.columns, three.rows) == (1, 1, 2, 2)
    for content in (one, three):
        assert sum(axes.get_visible() for axes in draw(content).axes) == len(content.panels)
        assert plot(content).layout.xaxis.domain[1] == (1.0 if content is one else pytest.approx(0.48))


def test_legend_covers_no_data(charts):
    for chart in (chart for chart in charts if isinstance(chart, Chart)):
        figure = draw(chart)
        figure.canvas.draw()
        for legend in figure.legends:
            assert not legend.get_window_extent().overlaps(figure.axes[0].get_window_extent()), chart.key


def test_kpis_of_a_made_up_log():
    time = np.arange(4) * 1.0
    log = xr.Dataset(
        {
            "plant": (("time", "plant_state"), [[0.0, 1.0], [3.0, 4.0], [0.0, 2.0], [0.0, 1.0]]),
            "reference": (("time", "output"), np.zeros((4, 2))),
            "step_time": ("time", [0.001, 0.002, 1.003, 2.0]),
            "waited_time": ("time", [0.001, 0.002, 0.003, 2.0]),  # the third was prepared in good time
            "status": ("time", ["OPTIMAL", "OPTIMAL", "BAD_MEASUREMENT", "OPTIMAL"]),
        },
        {"time": time, "plant_state": ["p_x", "p_y"], "output": ["p_x", "p_y"]},
        {"sampling_time_s": 1.0},
    )
    kpis = driving_kpis(log)
    assert kpis["tracking_error_rms_m"] == pytest.approx(np.sqrt((1 + 25 + 4 + 1) / 4))
    assert kpis["tracking_error_rms_after_2s_m"] == pytest.approx(np.sqrt(2.5))
    assert kpis["tracking_error_max_after_2s_m"] == 2.0
    assert kpis["step_time_us"]["p50"] == pytest.approx(502.5e3)
    assert kpis["deadline_misses"] == 1
    assert kpis["status_counts"] == {"OPTIMAL": 3, "BAD_MEASUREMENT": 1}


@pytest.fixture
def shown():
    """Draws a log; the axes by the first word of their title, and the figure."""
    import matplotlib as mpl

    mpl.use("Agg")

    def draw_log(log):
        figure = rumo.show(log)
        return {axes.get_title(loc="left").split()[0]: axes for axes in figure.axes}, figure

    return draw_log


def names_of(axes):
    return {label for label in axes.get_legend_handles_labels()[1] if label != "_nolegend_"}


def test_show_draws_what_is_what_is_wanted_and_what_is_believed(shown):
    log = PaperStudy(("rti",), duration=0.8).run()["rti"]
    axes, figure = shown(log)
    assert list(axes)[:11] == list(log.plant_state.values)
    assert set(axes) >= {*log.state.values, *log.input.values, "friction_front", "friction_rear", "Status"}
    assert axes["v_x"].get_title(loc="left") == "v_x [m/s]"
    assert names_of(axes["v_x"]) == {"Plant", "Measured", "Estimated", "Reference"}
    assert names_of(axes["w_fl"]) == {"Plant"}  # of which the controller knows nothing
    assert axes["delta"].get_title(loc="right") == "limits -0.7854, 0.7854"
    assert [text.get_text() for text in axes["Status"].get_yticklabels()] == ["OPTIMAL"]
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["Plant", "Estimated", "Measured", "Reference", "Applied"]


def test_show_draws_runs_of_any_length(shown):
    controller = rumo.RealTimeIteration(pendulum(), backend="reference")
    axes, _ = shown(Recorder(controller).log())
    assert list(axes) == ["No"]  # step was recorded
    log = rumo.simulate(controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 0.05)
    axes, _ = shown(log)
    assert all(line.get_marker() == "." for line in axes["angle"].lines)
    assert axes["torque"].lines[0].get_xdata().tolist() == [0.0, 0.05]
    with pytest.raises(rumo.ArgumentError, match="log: got 3, expected a log from"):
        rumo.show(3)


def test_show_draws_commands_where_they_were_not_applied(shown):
    controller = rumo.RealTimeIteration(pendulum(delay=1), backend="reference")
    drive = partial(rumo.simulate, controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 1.0)
    assert "Commanded" not in names_of(shown(drive())[0]["torque"])
    axes, figure = shown(drive(faults=[Stuck(range(5, 8), "torque", 0.0), Missing(range(10, 11), ("angle",))]))
    lines = {line.get_label(): line.get_ydata() for line in axes["torque"].lines}
    applied, commanded = lines["Applied"], lines["Commanded"]
    different = np.flatnonzero(applied != commanded)
    assert set(different[1:]) <= set(range(5, 8))  # nothing was commanded for the first sample
    bars = [collection.get_paths() for collection in axes["Status"].collections]
    assert [len(paths) for paths in bars] == [1, 2]  # BAD_MEASUREMENT in the middle of OPTIMAL
    figure.canvas.draw()
    legend = figure.legends[0].get_window_extent()
    assert not any(legend.overlaps(axes.get_tightbbox()) for axes in figure.axes)


def test_show_draws_whatever_is_measured(shown):
    model = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque - x.angle},
        outputs={"height": rumo.Output("m", lambda x, u, p: x.angle**2)},
    )
    controller = rumo.RealTimeIteration(pendulum(model=model), backend="reference")
    sensors = rumo.Sensors(measured=("angle", "rate", "height"))
    axes, _ = shown(rumo.simulate(controller, model, [0.1, 0.0], {"angle": 0.5}, 0.5, sensors=sensors))
    assert names_of(axes["height"]) == {"Measured"}


def test_show_draws_limits_that_are_near(shown):
    controller = rumo.RealTimeIteration(pendulum())
    log = rumo.simulate(controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 1.0)
    axes, _ = shown(log)
    drawn = {float(line.get_ydata()[0]) for line in axes["torque"].lines if line.get_label() == "Limit"}
    assert drawn <= {float(log.input_lower[0, 0]), float(log.input_upper[0, 0])}


def test_show_draws_limits_that_change_as_it_draws_others(shown):
    controller = rumo.RealTimeIteration(pendulum())
    log = rumo.simulate(controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 0.5)
    log["input_upper"][5:] = 1.0
    *_, line = (line for line in shown(log)[0]["torque"].lines if line.get_label() == "Limit")
    assert line.get_ydata().tolist() == [2.0] * 5 + [1.0] * 6  # the last is held as long as the others
    log["input_upper"][5:] = 5000.0
    log["input_upper"][:5] = 4000.0
    torque = shown(log)[0]["torque"]
    assert torque.get_ylim()[1] < 10.0
    assert "4000 to 5000" in torque.get_title(loc="right")
    log["input_upper"][:] = np.inf
    assert "5000" not in shown(log)[0]["torque"].get_title(loc="right")


def test_show_draws_a_recording_shorter_than_the_delay(shown):
    controller = rumo.RealTimeIteration(pendulum(delay=2), backend="reference")
    recorder = Recorder(controller)
    recorder.add(controller.step([0.1, 0.0], {"angle": 0.0}), time=0.0, measured=[0.1, 0.0], reference={"angle": 0.0})
    assert "torque" not in shown(recorder.log())[0]


def test_figures_are_kept_for_windows_only(shown):
    import matplotlib.pyplot as plt

    _, figure = shown(Recorder(rumo.RealTimeIteration(pendulum(), backend="reference")).log())
    assert not plt.fignum_exists(figure.number)


@pytest.mark.parametrize("name", ["angle", "an_angle_that_has_a_rather_long_name"])
def test_show_writes_limits_that_are_far_beside_long_names(shown, name):
    model = rumo.Model({name: "rad"}, {"torque": "N m"}, lambda x, u, p: {name: u.torque})
    bounds = {name: rumo.Bounds(-12345.0, 1234567.0, rumo.Penalty(1.0))}
    wanted = {"track": {name: rumo.Weight(1.0)}, "moves": {"torque": rumo.Weight(1.0)}}
    problem = rumo.Problem(model, horizon=3, sampling_time=0.1, bounds=bounds, **wanted)
    controller = rumo.RealTimeIteration(problem, backend="portable")
    axes, figure = shown(rumo.simulate(controller, model, [0.1], {name: 0.0}, 0.3))
    figure.canvas.draw()
    titles = [
        title for title in (axes[name].title, axes[name]._left_title, axes[name]._right_title) if title.get_text()
    ]
    assert "limits -1.234e+04, 1.235e+06" in " ".join(title.get_text() for title in titles)
    extents = [title.get_window_extent() for title in titles]
    assert not (len(extents) == 2 and extents[0].overlaps(extents[1]))


def test_a_signal_that_stays_at_zero_fills_no_panel_with_rounding(shown):
    controller = rumo.RealTimeIteration(pendulum())
    log = rumo.simulate(controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 1.0)
    log["plant"][:, 1] = 1e-14 * np.sin(np.arange(log.sizes["time"]))
    low, high = shown(log)[0]["rate"].get_ylim()
    assert high - low > 1.0


def test_a_wild_measurement_does_not_flatten_the_truth(shown):
    log = PaperStudy(("rti",), duration=0.8, estimator=None).run()["rti"]
    log["received"][7, 1] = 100.0
    low, high = shown(log)[0]["p_y"].get_ylim()
    assert high - low < 10.0


def test_show_takes_old_logs_and_those_of_a_loop_of_ones_own(shown):
    log = PaperStudy(("rti",), duration=0.4).run()["rti"]
    new = ["received", "true_outputs", "estimated_outputs", "true_constraints", "true_states", "constraints"]
    axes, _ = shown(log.drop_vars([*new, "state_lower", "state_upper"]))
    assert names_of(axes["v_x"]) == {"Plant", "Measured", "Estimated", "Reference"}
    controller = rumo.RealTimeIteration(pendulum())
    recorder = Recorder(controller)
    for k in range(3):
        plan = controller.step([0.1, 0.0], {"angle": 0.0})
        recorder.add(plan, time=0.1 * k, measured=[0.1, 0.0], applied=plan.command.values, reference={"angle": 0.0})
    axes, _ = shown(recorder.log())
    assert names_of(axes["angle"]) == {"Reference", "Measured"}


def test_a_heat_map_is_the_same_on_page_and_in_print():
    values = np.array([[1.0, np.nan], [2.0, 3.0]])
    x, y = Axis("speed [m/s]", ("6", "8")), Axis("mu [1]", ("0.7", "0.9", "1.1"))
    panels = (("RTI", values, np.ones((2, 2), dtype=int)),)
    content = HeatMap(
        key="map", title="Map", x_label="", y_label="", panels=panels, x=x, y=y, label="Error [m]", span=(1.0, 3.0)
    )
    (cells,) = plot(content).data
    assert sorted(zip(cells.x, cells.base + 0.5, cells.text, strict=True)) == [(0, 0, "1"), (0, 1, "2"), (1, 1, "3")]
    printed = draw(content).axes[0]
    np.testing.assert_array_equal(np.ma.filled(printed.collections[0].get_array(), np.nan), values)
    assert [text.get_text() for text in printed.texts] == ["1", "2", "3"]
    assert (x.places(2).tolist(), y.places(2).tolist()) == ([0, 1], [-0.5, 0.5, 1.5])  # below cells, and between them


def test_on_narrow_screens_labels_stay_where_they_are():
    line = Line("a", np.arange(3.0), np.arange(3.0), NEUTRAL)
    for title in ("", "Panel"):
        content = Panels("key", "Title", "Runs [%]", "y [1]", ((title, (line,)),))
        annotations = {each["text"]: each for each in narrow_layout(content, plot(content))["annotations"]}
        assert annotations["Runs [%]"]["y"] == 0
        assert title not in annotations or annotations[title]["y"] == 1.0
