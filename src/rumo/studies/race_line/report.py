"""What is shown of lines around tracks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.references import Track
from rumo.report.charts import Chart, Colored, Line, Look, Panels
from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.drive.charts import ALONG, EDGE, HIGHEST, LOWEST, WIDTH
from rumo.studies.race_line.lines import CENTRE, CURVATURE, LINES, LOOKS, TIME, TimedLine

BESIDE = Look("#000000", "dash", 0.7)
"""Of a line beside the one in colours."""
ALIKE = 0.05
"""Times that differ by less than so many per cent are told as the same."""


def sections(
    content: Mapping[str, Any], results: Mapping[str, Mapping[str, TimedLine]], tracks: Mapping[str, Track]
) -> list[Section]:
    """For each track a table, what it says, and figures."""
    found: list[Section] = []
    for name, lines in results.items():
        outcomes = content["tracks"][name]
        figures = [line_chart(name, lines, tracks[name]), along_panels(name, lines, tracks[name])]
        found.append(Section(titled(name), [lines_table(outcomes), *finding(lines), *figures], brief=True))
    return found


def lines_table(outcomes: Mapping[str, Mapping[str, Any]]) -> Table:
    """A row for each line of a track."""
    driven = any("ended" in each for each in outcomes.values())
    heads = ["", "Length\n[m]", "Lap, by\nprofile [s]", "of centre\nline's [%]", "Slowest\n[m/s]", "Fastest\n[m/s]"]
    heads += [
        "Lap,\nprogram's [s]",
        *(["Lap, driven\n[s]", "Beside\nline [m]", "Least\nroom [m]"] if driven else []),
    ]
    centre = outcomes.get(CENTRE, {}).get("lap_time_s")
    rows: list[list[str]] = []
    for line, each in outcomes.items():
        program = each.get("program_time_s")
        row = [
            LINES[line],
            number(each["length_m"]),
            f"{each['lap_time_s']:.2f}",
            "-" if centre is None else f"{100.0 * each['lap_time_s'] / centre:.1f}",
            number(each["slowest_m_s"]),
            number(each["fastest_m_s"]),
            "-" if program is None else f"{program:.2f}" if each["found"] else "not found",
        ]
        if driven:
            lap, aside = each.get("driven_lap_time_s"), each.get("driven_lateral_deviation_rms_m")
            row += ["lost" if lap is None else f"{lap:.2f}", number(aside), number(each["driven_least_room_m"])]
        rows.append(row)
    return Table(heads, rows)


def finding(lines: Mapping[str, TimedLine]) -> list[str]:
    """What the lines of a track say of each other, in a sentence or two."""
    if TIME not in lines:
        return []
    best, said = lines[TIME], list[str]()
    if not best.outcome["found"]:
        said.append(f"IPOPT found no end in {best.outcome['iterations']} iterations; this line is the last it tried.")
    for other in (CURVATURE, CENTRE):
        if other in lines:
            said.append(_compared(best, lines[other], LINES[other].lower()))
    if CURVATURE in lines:
        apart = np.abs(_at(lines[CURVATURE], best.s) - best.aside)
        where = int(np.argmax(apart))
        said.append(f"The two race lines are up to {apart[where]:.1f} m apart, at {best.s[where]:.0f} m.")
    return [" ".join(said)]


def _compared(best: TimedLine, other: TimedLine, name: str) -> str:
    gain = 100.0 * (1.0 - best.outcome["lap_time_s"] / other.outcome["lap_time_s"])
    name = f"the {name}" if name == LINES[CENTRE].lower() else f"that of {name}"
    if abs(gain) < ALIKE:
        return f"The line of least time takes as long as {name}."
    return f"The line of least time takes {abs(gain):.1f} % {'less' if gain > 0.0 else 'more'} than {name}."


def line_chart(name: str, lines: Mapping[str, TimedLine], track: Track) -> Chart:
    """The line of least time, or the best there is, in the colours of its speed; the others beside it."""
    shown = next(line for line in (TIME, CURVATURE, CENTRE) if line in lines)
    s = np.linspace(0.0, track.path.length, max(200, round(track.path.length)))
    left, right = track.edges(s)
    edges = np.vstack([left, np.full((1, 2), np.nan), right])
    drawn = [Line("Edges of the track", edges[:, 0], edges[:, 1], EDGE)]
    for line, each in lines.items():
        if line not in (shown, CENTRE):
            at = each.path.at(np.linspace(0.0, each.path.length, len(s)))
            drawn.append(Line(LINES[line], at.x, at.y, BESIDE))
    best = lines[shown]
    at = best.path.at(np.linspace(0.0, best.path.length, len(best.speed)))
    spans = np.nanmax(edges, axis=0) - np.nanmin(edges, axis=0)
    height = 1.0 + float(np.clip(WIDTH * spans[1] / max(spans[0], 1e-9), LOWEST, HIGHEST))
    return Chart(
        f"line-{name}",
        f"{titled(name)}: {LINES[shown].lower()}, coloured by speed",
        "x [m]",
        "y [m]",
        tuple(drawn),
        colored=Colored(at.x, at.y, best.speed, "Speed [m/s]"),
        equal=True,
        height=height,
    )


def along_panels(name: str, lines: Mapping[str, TimedLine], track: Track) -> Panels:
    """Where the lines are between the edges, and how fast, along the centre line."""
    s = np.linspace(0.0, track.path.length, max(200, round(track.path.length)))
    left, right = track.limits(s)
    gap = np.full(1, np.nan)
    edges = Line("Edges of the track", np.r_[s, gap, s], np.r_[left, gap, -right], EDGE)
    aside = (*(Line(LINES[line], each.s, each.aside, LOOKS[line]) for line, each in lines.items()), edges)
    speed = tuple(Line(LINES[line], each.s, each.speed, LOOKS[line]) for line, each in lines.items())
    panels = (("To the left of the centre line [m]", aside), ("Speed [m/s]", speed))
    return Panels(
        f"along-{name}",
        f"{titled(name)}: lines and their speeds",
        ALONG.replace("path", "centre line"),
        "",
        panels,
        shared="x",
        height=1.9,
        across=1,
    )


def titled(name: str) -> str:
    """A track's name with a capital letter, its others as they are."""
    return name[:1].upper() + name[1:]


def _at(line: TimedLine, s: Any) -> Any:
    """How far a line is to the left of the centre line at arc lengths of that."""
    order = np.argsort(line.s)
    return np.interp(s, line.s[order], line.aside[order])
