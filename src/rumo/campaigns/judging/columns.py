"""What the columns of a campaign's rows are called, and what readers know them as."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.tasks.rows import DONE
from rumo.studies.kpis import KPIS, Driven, Kpi
from rumo.studies.kpis.base import Value

if TYPE_CHECKING:
    import pandas as pd

KPI, SETTING, STATUS, RUN = "kpi.", "setting.", "status.", "run."
"""With which names of columns begin: figures of merit, settings of a draw, counts of statuses, and what differs from
one time to the next."""
MADE_WITH = ("rumo", "python", "casadi", "numpy", "scipy", "backend", "machine", "host")
"""What is no setting and yet decides last digits, in columns `run.NAME`: versions, the build that drove, machines."""
SEED = "seed"
"""The last part of names of settings that number what happens by chance, and do not measure anything."""


def _of_steps(part: str, words: str) -> Kpi:
    whole = KPIS["step_time"]

    def of(drive: Driven) -> Value:
        value = whole.of(drive)
        return value[part] if isinstance(value, Mapping) else None

    return replace(whole, name=f"{whole.name}_{part}", title=f"{whole.title}, {words}", of=of)


PARTS = {"p50": "median", "p99": "99 %", "max": "largest"}
"""Of times of steps, which have a column each."""
BY_KEY = {kpi.key: kpi for kpi in (*KPIS.values(), *(_of_steps(*part) for part in PARTS.items()))}
"""Figures of merit by the keys that they have in names of columns."""


def column_of(key: str, columns: Iterable[str]) -> str | None:
    """Column with a figure of merit, which times have among what differs from run to run; None if there is none."""
    known = set(columns)
    return next((name for name in (KPI + key, RUN + key) if name in known), None)


def key_of(column: str) -> str:
    """Key of a figure of merit, with its part: "input_variation_per_s.torque"."""
    return column.removeprefix(KPI).removeprefix(RUN)


def kpi_of(column: str) -> Kpi | None:
    """The figure of merit that a column has; None if it is none of ours."""
    return BY_KEY.get(key_of(column).partition(".")[0])


def title_of(column: str) -> str:
    """A figure of merit for readers: "RMS error after 2 s", "Variation a second, torque"."""
    kpi, (name, _, part) = kpi_of(column), key_of(column).partition(".")
    title = name.replace("_", " ") if kpi is None else kpi.title
    return f"{title}, {part}" if part else title


def inside(title: str) -> str:
    """A title within a sentence: abbreviations such as RMS stay as they are."""
    return title if title[:2].isupper() else title[:1].lower() + title[1:]


def unit_of(column: str) -> str:
    """Unit of a figure of merit; nothing if it has none."""
    kpi = kpi_of(column)
    return "" if kpi is None or kpi.unit == "1" else kpi.unit


def with_unit(column: str) -> str:
    """Title and unit: "RMS error after 2 s [m]"."""
    return f"{title_of(column)} [{unit_of(column) or '1'}]"


def better_of(column: str) -> str:
    """Which figures are better, "less" or "more"; nothing if neither are."""
    kpi = kpi_of(column)
    return "less" if kpi is None else kpi.better


def is_seed(setting: str) -> bool:
    """Whether a setting numbers what happens by chance."""
    return setting.rpartition(".")[2] == SEED


def numbers(rows: pd.DataFrame, column: str) -> NDArray[np.float64]:
    """A column as floats (n,), NaN where it has none, or an infinite one, which no figure or sum could show."""
    import pandas as pd

    found: Any = pd.to_numeric(rows[column], errors="coerce")
    values = found.to_numpy(dtype=float, na_value=np.nan)
    return np.where(np.isfinite(values), values, np.nan)


def texts(rows: pd.DataFrame, column: str) -> list[str]:
    """A column as words, nothing where it has none."""
    if column not in rows.columns:
        return [""] * len(rows)
    found: Any = rows[column]
    return ["" if empty else str(value) for value, empty in zip(found, found.isna(), strict=True)]


def done(rows: pd.DataFrame) -> NDArray[np.bool_]:
    """Which runs came to their end (n,)."""
    found: Any = rows["outcome"]
    return (found == DONE).to_numpy(dtype=bool)
