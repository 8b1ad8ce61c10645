"""The paper study's summary: what the paper claims and what we measure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rumo.report.kpis import driving_kpis

if TYPE_CHECKING:
    import xarray as xr


def summary(logs: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    """Content of `summary.json`.

    Parameters
    ----------
    logs : mapping of str to xarray.Dataset
        At least one log, by controller name.
    """
    first = next(iter(logs.values()))
    controllers = {name: driving_kpis(log) for name, log in logs.items()}
    return {
        "study": "paper",
        "seed": int(first.attrs["seed"]),
        "sampling_time_s": float(first.attrs["sampling_time_s"]),
        "horizon": int(first.attrs["horizon"]),
        "controllers": controllers,
        "claims": claims(controllers, {name: log.sizes["time"] for name, log in logs.items()}),
    }


def claims(controllers: Mapping[str, Any], steps: Mapping[str, int]) -> list[dict[str, Any]]:
    """The paper's claims beside our figures; None where a controller did not run.

    The paper's times are from an Apple M2 Max.
    """

    def figure(name: str, *keys: str, scale: float = 1.0) -> float | None:
        value: Any = controllers.get(name)
        for key in keys:
            value = None if value is None else value[key]
        return None if value is None else scale * value

    def ratio(above: float | None, below: float | None) -> float | None:
        return None if above is None or below is None else above / below

    nlp_mean = figure("nlp", "step_time_us", "mean", scale=1e-3)
    rti_mean = figure("rti", "step_time_us", "mean", scale=1e-3)
    nlp_rms = figure("nlp", "tracking_error_rms_after_2s_m")
    rti_rms = figure("rti", "tracking_error_rms_after_2s_m")
    rows = [
        ("Mean step time of the direct NLP", 106, nlp_mean, "ms"),
        ("Mean step time of the RTI", 15, rti_mean, "ms"),
        ("Mean step time, NLP over RTI", 7, ratio(nlp_mean, rti_mean), "1"),
        (
            "NLP steps that exceed the sampling period",
            100,
            ratio(figure("nlp", "deadline_misses", scale=100.0), steps.get("nlp")),
            "%",
        ),
        (
            "RTI steps that exceed the sampling period",
            "few",
            ratio(figure("rti", "deadline_misses", scale=100.0), steps.get("rti")),
            "%",
        ),
        ("The NLP tracks: RMS error after 2 s", "tracks", nlp_rms, "m"),
        ("The RTI tracks: RMS error after 2 s", "tracks", rti_rms, "m"),
        ("The RTI is not worse: RMS error, RTI over NLP", "about 1", ratio(rti_rms, nlp_rms), "1"),
    ]
    return [dict(zip(("claim", "printed", "ours", "unit"), row, strict=True)) for row in rows]
