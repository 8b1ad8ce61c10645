"""One self-contained HTML page with interactive figures, by Plotly."""

from __future__ import annotations

import json
import re
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from rumo.files import write_whole
from rumo.report.charts import Figure
from rumo.report.contents import Beside, Command, Folded, Item, Report
from rumo.report.plots import narrow_layout, plot, template
from rumo.report.tables import Table

NARROW = 640
"""Screens narrower than this show panels below each other [px]."""

STYLE = """
:root { color-scheme: light; scrollbar-gutter: stable; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 68rem; margin: 0 auto; padding: 1.5rem; }
h1 { margin-bottom: 0; } h2 { margin: 2.5rem 0 .5rem; }
p.lead { margin-top: .25rem; color: #57606a; }
p.warning { padding: .6rem 1rem; border-left: .3rem solid #d55e00; background: #fdf0e7; }
figure { margin: 1.5rem 0 2.5rem; } figcaption { font-weight: 600; }
table { border-collapse: collapse; width: 100%; font-size: .94rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .3rem .5rem; border-bottom: 1px solid #d8dee4; white-space: nowrap; }
th { white-space: pre-line; vertical-align: bottom; }
.words { text-align: left; } td.words { white-space: normal; min-width: 7rem; }
pre { background: #f6f8fa; border: 1px solid #d8dee4; border-radius: .3rem; padding: .5rem .8rem; overflow-x: auto;
  font: .88rem/1.45 ui-monospace, monospace; }
details { border-bottom: 1px solid #d8dee4; padding: .5rem 0; }
summary { cursor: pointer; font-weight: 600; } details > :nth-child(2) { margin-top: .6rem; }
details figure { margin: .75rem 0; }
.beside { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr)); gap: 0 1.5rem; }
.beside figure { min-width: 0; }
.scroll { margin: 1rem 0; overflow-x: auto; /* a shadow as long as there is more to the right */
  background: linear-gradient(to left, #fff 50%, #fff0) right / 3rem 100% no-repeat local,
    linear-gradient(to left, #0003, #0000) right / .8rem 100% no-repeat scroll; }
@media (max-width: 640px) {
  body { padding: .75rem; } table { font-size: .8rem; } th, td { padding: .25rem .3rem; } td.words { min-width: 4rem; }
}
"""

SCRIPT = """
const narrow = matchMedia("(max-width: %dpx)"), figures = [];
function show(id, figure, changes) {
  if (document.readyState == "loading") {  // how much room there is shows when all is there
    addEventListener("DOMContentLoaded", () => show(id, figure, changes));
    return;
  }
  const folded = document.getElementById(id).closest("details:not([open])");
  if (folded) {  // in which there is no room yet
    folded.addEventListener("toggle", () => show(id, figure, changes), {once: true});
    return;
  }
  const layout = {...figure.layout, template}, before = {};
  for (const key in changes) before[key] = key.split(".").reduce((part, name) => part?.[name], layout) ?? null;
  Plotly.newPlot(id, figure.data, layout, {displaylogo: false, responsive: true,
    modeBarButtonsToRemove: ["select2d", "lasso2d"]});
  figures.push(() => Plotly.relayout(id, structuredClone(narrow.matches ? changes : before)));
  if (narrow.matches) figures.at(-1)();
}
narrow.addEventListener("change", () => figures.forEach(fit => fit()));
"""


def write_page(path: Path, report: Report) -> None:
    """Write a study's report as one file that needs no network.

    Parameters
    ----------
    path : Path
        The HTML file.
    report : Report
        What it shows.
    """
    # Lines, points and bars are all that is drawn: Plotly's basic bundle, a quarter of the whole.
    plotly = files("rumo.report").joinpath("assets", "plotly-basic.min.js").read_text(encoding="utf-8")
    warning = f'<p class="warning">{escape(report.warning)}</p>' if report.warning else ""
    body = "\n".join(
        f"<h2>{escape(section.heading)}</h2>\n" + "\n".join(map(_html, section.content)) for section in report.sections
    )
    html = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(report.title)}</title><style>{STYLE}</style>
<script>{plotly}</script>
<script>const template = {_json(template())};{SCRIPT % NARROW}</script></head><body>
<h1>{escape(report.title)}</h1><p class="lead">{escape(report.lead)}</p>
{warning}
{body}
</body></html>
"""
    write_whole(path, lambda place: place.write_text(html, encoding="utf-8"))


def figures_of(path: Path) -> list[str]:
    """Keys of the figures on a page, which `write_page` has written; none if it is not there."""
    html = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    return re.findall(r'<div id="([\w-]+)" class="plotly-graph-div"></div>', html)


def _html(content: Item) -> str:
    match content:
        case str():
            return f"<p>{escape(content)}</p>"
        case Table():
            return _table(content)
        case Command():
            return f"<pre><code>{escape(content.text)}</code></pre>"
        case Beside():
            return f'<div class="beside">{"".join(map(_html, content.content))}</div>'
        case Folded():
            inside = "\n".join(map(_html, content.content))
            opened = " open" if content.open else ""
            return f"<details{opened}><summary>{escape(content.heading)}</summary>\n{inside}</details>"
        case _:
            return _figure(content)


def _table(table: Table) -> str:
    def row(cells: list[str], tag: str) -> str:
        kinds = [' class="words"' if i in table.words else "" for i in range(len(cells))]
        return "".join(f"<{tag}{kind}>{escape(text)}</{tag}>" for text, kind in zip(cells, kinds, strict=True))

    head = f"<thead><tr>{row(table.heads, 'th')}</tr></thead>"
    body = "".join(f"<tr>{row(cells, 'td')}</tr>" for cells in table.rows)
    return f'<div class="scroll"><table>{head}<tbody>{body}</tbody></table></div>'


def _figure(content: Figure) -> str:
    figure = plot(content)
    data, narrow = _script(figure.to_json()), _json(narrow_layout(content, figure))
    return f"""<figure><figcaption>{escape(content.title)}</figcaption>
<div id="{content.key}" class="plotly-graph-div"></div>
<script>show("{content.key}", {data}, {narrow});</script></figure>"""


def _json(content: Any) -> str:
    return _script(json.dumps(content))


def _script(text: str) -> str:
    """JSON that may stand in a script."""
    return text.replace("</", "<\\/")
