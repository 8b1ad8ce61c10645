"""MkDocs hooks: equations become MathML, and quoted source code is read from the source."""

from __future__ import annotations

import ast
import re
from html import unescape
from pathlib import Path
from textwrap import dedent
from typing import Any
from xml.etree.ElementTree import Element, tostring

from latex2mathml.converter import convert_to_element
from mkdocs.exceptions import PluginError

SOURCE = Path(__file__).parents[1] / "src" / "rumo"
CORE = Path(__file__).parents[1] / "core" / "src"

# {{ code controllers/engines/numpy.py NumpyRti.prepare }} quotes a definition without its docstring;
# {{ code controllers/engines/numpy.py NumpyRti.iterate "first line" "last line" }} quotes a part of it.
# {{ c guard/follow.c follow "first line" "last line" }} does the same for the core.
QUOTE_OF_C = re.compile(r'^\{\{ c (?P<file>\S+) (?P<name>\w+)(?: "(?P<first>.+?)" "(?P<last>.+?)")? \}\}$', re.M)
QUOTE = re.compile(r'^\{\{ code (?P<file>\S+) (?P<name>[\w.]+)(?: "(?P<first>.+?)" "(?P<last>.+?)")? \}\}$', re.M)
EQUATION = re.compile(r'<(?P<tag>span|div) class="arithmatex">\s*\\[(\[](?P<latex>.*?)\\[)\]]\s*</(?P=tag)>', re.DOTALL)
ACCENTS = {"^": "\u02c6", "\u02d9": "\u02d9", "\u00af": "\u00af", "\u02dc": "\u02dc"}
"""Hat, dot, bar and tilde, as latex2mathml writes them and as they stand best above a letter."""
CAPITAL_GREEK = "\u0393\u0394\u0398\u039b\u039e\u03a0\u03a3\u03a6\u03a8\u03a9"
FUNCTIONS = ("sin", "cos", "tan")
SIGNS = ("-", "\u2212", "+", "\u00b1", "\u2213")
OPENING = ("(", "[", ",", "=", "<", "\u2264", "\u2265", "\u2248")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put quoted source code in."""
    return QUOTE_OF_C.sub(_quoted_c, QUOTE.sub(_quoted, markdown))


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Turn the equations that arithmatex has marked into MathML."""

    def replaced(match: re.Match[str]) -> str:
        block = match["tag"] == "div"
        mathml = mathml_of(unescape(match["latex"]).strip(), block=block, where=page.file.src_uri)
        return f'<div class="equation">{mathml}</div>' if block else mathml

    return EQUATION.sub(replaced, html)


def mathml_of(latex: str, *, block: bool, where: str) -> str:
    """MathML of an equation, in the form that browsers draw without help."""
    # latex2mathml knows align*, which has no numbers, but not aligned.
    math = convert_to_element(latex.replace("{aligned}", "{align*}"), display="block" if block else "inline")
    for element in math.iter():
        element.text = unescape(element.text or "")
        if "\\" in element.text or element.text == "&":
            raise PluginError(f"{where}: latex2mathml does not understand {element.text!r} in {latex!r}")
    for parent in math.iter():
        before: Element | None = None
        for element in parent:
            _adapt(element)
            if element.text in SIGNS and (before is None or (before.tag == "mo" and before.text in OPENING)):
                element.set("form", "prefix")
            if element.tag != "mspace" and (element.tag != "mi" or element.text):
                before = element
    return tostring(math, encoding="unicode")


def _adapt(element: Element) -> None:
    """Replace what browsers leave out of MathML, and set a few things as TeX does."""
    text = element.text or ""
    if element.get("mathvariant") in ("bold", "bold-italic"):
        element.text = _bold_italic(text)
        del element.attrib["mathvariant"]
    elif element.tag == "mi" and text in FUNCTIONS:
        element.tag = "mo"
        element.attrib.update(form="prefix", lspace="0.167em", rspace="0")
    elif element.tag == "mi" and text and text in CAPITAL_GREEK:
        element.set("mathvariant", "normal")
    elif element.tag == "mo" and text in ("/", "|", "\u2202", "max"):
        element.attrib.update(lspace="0", rspace="0")
    elif element.tag == "mo" and text == "\u2016":
        element.set("stretchy", "false")
    elif element.tag == "mover" and element[1].text in ACCENTS:
        element.set("accent", "true")
        element[1].text = ACCENTS[element[1].text]
        element[1].set("stretchy", "false")
    elif element.tag == "msub" and element[0].text == "min":
        element.tag = "munder"
    elif element.tag == "mtd" and element.get("columnalign"):
        element.set("class", element.attrib["columnalign"])


def _bold_italic(letters: str) -> str:
    """The bold italic mathematical forms of Latin letters, others as they are."""
    return "".join(
        chr(0x1D468 + ord(c) - ord("A"))
        if "A" <= c <= "Z"
        else chr(0x1D482 + ord(c) - ord("a"))
        if "a" <= c <= "z"
        else c
        for c in letters
    )


def _quoted(match: re.Match[str]) -> str:
    file = SOURCE / match["file"]
    lines = file.read_text(encoding="utf-8").splitlines()
    node = _definition(ast.parse("\n".join(lines)), match["name"])
    if node is None:
        raise PluginError(f"{match[0]}: {file} has no {match['name']}")
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    start = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
    shown = lines[start - 1 : node.body[0].lineno - 1] + lines[body[0].lineno - 1 : node.end_lineno]
    if match["first"]:
        shown = _between(lines[start - 1 : node.end_lineno], match["first"], match["last"], match[0])
    code = dedent("\n".join(shown)).strip("\n")
    return f'```python title="src/rumo/{match["file"]}"\n{code}\n```'


def _quoted_c(match: re.Match[str]) -> str:
    source = (CORE / match["file"]).read_text(encoding="utf-8")
    found = re.search(rf"^(?:RARE )?static [^;=]*?\b{match['name']}\([^;]*?\) {{\n.*?^}}$", source, re.M | re.S)
    if found is None:
        raise PluginError(f"{match[0]}: {match['file']} has no {match['name']}")
    lines = found[0].splitlines()
    if match["first"]:
        lines = _between(lines, match["first"], match["last"], match[0])
    return f'```c title="core/src/{match["file"]}"\n{dedent(chr(10).join(lines))}\n```'


def _definition(tree: ast.AST, name: str) -> Any:
    found: Any = tree
    for part in name.split("."):
        found = next((node for node in ast.iter_child_nodes(found) if getattr(node, "name", None) == part), None)
        if found is None:
            return None
    return found


def _between(lines: list[str], first: str, last: str, quote: str) -> list[str]:
    start = next((i for i, line in enumerate(lines) if first in line), None)
    if start is None:
        raise PluginError(f"{quote}: no line has {first!r}")
    end = next((i for i, line in enumerate(lines[start:], start) if last in line), None)
    if end is None:
        raise PluginError(f"{quote}: no line has {last!r}")
    return lines[start : end + 1]
