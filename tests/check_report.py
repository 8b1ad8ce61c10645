"""Check the folder that `rumo study paper` wrote: `python tests/check_report.py out`."""

import json
import sys
from pathlib import Path

FIGURES = ["trajectory-first-2s", "trajectory", "wind", "torque", "steering-rate", "tracking-error", "difference"]


def check(folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    names = list(summary["controllers"])
    for name in names:
        assert (folder / f"log-{name}.nc").stat().st_size > 100_000, name
    for figure in FIGURES + [f"step-time-{name}" for name in names]:
        for ending in ("png", "pdf"):
            assert (folder / f"{figure}.{ending}").stat().st_size > 5_000, figure
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count('class="plotly-graph-div"') == len(FIGURES) + len(names)
    assert 'src="http' not in page, "the report must be self-contained"
    assert len(page) < 2_000_000, len(page)
    rti, nlp = (summary["controllers"][name]["tracking_error_rms_after_2s_m"] for name in ("rti", "nlp"))
    assert rti <= 0.35, rti
    assert abs(rti / nlp - 1.0) <= 0.1, (rti, nlp)
    print(f"report in {folder}: {len(names)} controllers, RMS after 2 s {rti:.3f} m (RTI), {nlp:.3f} m (NLP)")


if __name__ == "__main__":
    check(Path(sys.argv[1]))
