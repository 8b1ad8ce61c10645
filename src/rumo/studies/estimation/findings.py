"""What was found, in sentences that follow from the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.studies.estimation.contenders import CONTENDERS
from rumo.studies.estimation.outcome import NEAR
from rumo.studies.estimation.questions import QUESTIONS

ALIKE = 0.05
"""Two figures that differ by less than this share are told as the same."""


def finding(question: str, estimators: Mapping[str, Mapping[str, Any]]) -> str:
    """Sentences on one question, from a summary's entry of its estimators; none of fewer than two."""
    if len(estimators) < 2:
        return ""
    asked = QUESTIONS[question]
    said = [_ranked(estimators)]
    if asked.extra:
        said += [_unknown(next(iter(asked.extra)), estimators), _beyond(estimators)]
    if asked.off:
        said.append(_settled(estimators))
    said += [_lost(estimators), _times(estimators)]
    return " ".join(sentence for sentence in said if sentence)


def _ranked(estimators: Mapping[str, Mapping[str, Any]]) -> str:
    """Who knows the position best, and how much worse the others are."""
    errors = {name: found["rmse"].get("position") for name, found in estimators.items()}
    known = sorted((error, name) for name, error in errors.items() if error is not None)
    if not known:
        return ""
    best = known[0][0]
    alike = [name for error, name in known if error <= (1.0 + ALIKE) * best]
    others = [(error, name) for error, name in known if name not in alike]
    said = f"{_listed(alike)} {'knows' if len(alike) == 1 else 'know'} the position to {_metres(best)}"
    if not others:
        return f"{said}: no difference."
    return f"{said}; {', '.join(f'{_title(name)} to {_metres(error)}' for error, name in others)}."


def _unknown(name: str, estimators: Mapping[str, Mapping[str, Any]]) -> str:
    errors = {each: found["rmse"].get(name) for each, found in estimators.items()}
    told = [f"{_title(each)} to {error:.2f}" for each, error in errors.items() if error is not None]
    return f"What is unknown besides is known by {', '.join(told)}." if told else ""


def _beyond(estimators: Mapping[str, Mapping[str, Any]]) -> str:
    over = {name: found for name, found in estimators.items() if found["beyond"]}
    if not over:
        return "No estimate was beyond its bound."
    return (
        "; ".join(
            f"{_title(name)} was beyond the bound in {100.0 * found['beyond']:.0f} % of the samples, by up to "
            f"{found['farthest']:.2f}"
            for name, found in over.items()
        )
        + "."
    )


def _settled(estimators: Mapping[str, Mapping[str, Any]]) -> str:
    said = [
        f"{_title(name)} {'never' if found['settled_s'] is None else 'after {:.2f} s'.format(found['settled_s'])}"
        for name, found in estimators.items()
    ]
    return f"The heading stays within {NEAR:g} rad, at worst: {', '.join(said)}."


def _lost(estimators: Mapping[str, Mapping[str, Any]]) -> str:
    lost = [
        f"{_title(name)} {found['lost']} of {found['drives']}" for name, found in estimators.items() if found["lost"]
    ]
    return f"Drives lost: {', '.join(lost)}." if lost else ""


def _times(estimators: Mapping[str, Mapping[str, Any]]) -> str:
    slow = {name: found["update_time_ratio"] for name, found in estimators.items()}
    told = [f"{_title(name)} {ratio:.3g}" for name, ratio in slow.items() if ratio is not None and ratio > 1.0 + ALIKE]
    return f"An update takes so many times the plain filter's: {', '.join(told)}." if told else ""


def _title(name: str) -> str:
    return CONTENDERS[name].title


def _listed(names: list[str]) -> str:
    *others, last = map(_title, names)
    return f"{', '.join(others)} and {last}" if others else last


def _metres(error: float) -> str:
    return f"{error:.3f} m" if error < 1.0 else f"{error:.2f} m"
