"""Figures: complete, labelled with units, told apart without colours."""

import re

import numpy as np
import pytest
import xarray as xr

import rumo
from rumo.report.charts import Chart, Panels
from rumo.report.figures import draw
from rumo.report.kpis import driving_kpis
from rumo.report.plots import plot
from rumo.studies import PaperStudy
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
            assert chart.marker == (40.0, "Sampling period, 40 ms")
            continue
        assert len(printed.lines) == len(interactive.data) == len(chart.lines)
        for line, trace, source in zip(printed.lines, interactive.data, chart.lines, strict=True):
            np.testing.assert_array_equal(line.get_ydata(), source.y)
            np.testing.assert_array_equal(trace.y, source.y)


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
            "step_time": ("time", [0.001, 0.002, 0.003, 2.0]),
            "status": ("time", ["OPTIMAL", "OPTIMAL", "BAD_MEASUREMENT", "OPTIMAL"]),
        },
        {"time": time, "plant_state": ["p_x", "p_y"], "output": ["p_x", "p_y"]},
        {"sampling_time_s": 1.0},
    )
    kpis = driving_kpis(log)
    assert kpis["tracking_error_rms_m"] == pytest.approx(np.sqrt((1 + 25 + 4 + 1) / 4))
    assert kpis["tracking_error_rms_after_2s_m"] == pytest.approx(np.sqrt(2.5))
    assert kpis["tracking_error_max_after_2s_m"] == 2.0
    assert kpis["step_time_us"]["p50"] == pytest.approx(2500.0)
    assert kpis["deadline_misses"] == 1
    assert kpis["status_counts"] == {"OPTIMAL": 3, "BAD_MEASUREMENT": 1}


def test_show_draws_every_signal():
    import matplotlib as mpl

    mpl.use("Agg")
    from problems import pendulum

    controller = rumo.RealTimeIteration(pendulum())
    log = rumo.simulate(controller, controller.problem.model, [0.1, 0.0], {"angle": 0.5}, 1.0)
    figure = rumo.show(log)
    assert [axes.get_ylabel() for axes in figure.axes if axes.get_visible()] == [
        "angle [rad]",
        "rate [rad/s]",
        "torque [N m]",
    ]
    mpl.pyplot.close(figure)
