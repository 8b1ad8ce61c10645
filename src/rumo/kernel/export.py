"""A problem as C: constant tables by the names of rumo_core.h, for programs that run without Python."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.kernel._core import TABLES
from rumo.kernel.description import Description, part_prefix


def array_source(name: str, values: np.ndarray) -> str:
    """The definition of a constant array in C, row by row; of int or double, read back to the last bit."""
    kind = "int" if values.dtype.kind in "biu" else "double"
    numbers = ", ".join(_number(value) for value in values.ravel().tolist())
    body = textwrap.fill(numbers, 116, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)
    return f"static const {kind} {name}[] = {{\n{body}}};\n"


def problem_source(description: Description, name: str = "problem") -> str:
    """The text of a C header that defines a `rumo_problem`.

    Parameters
    ----------
    description : Description
        What the core needs to know.
    name : str
        Of the problem in C; the names of its arrays begin with it.
    """
    guard = f"{name.upper()}_H"
    return f"""\
/* A problem of model predictive control, made by Rumo: hand it to the core's create(). */
#ifndef {guard}
#define {guard}

#include <math.h>
#include <stddef.h>

#include "rumo_core.h"

{struct_source("rumo_problem", description.values, name)}
#endif
"""


def struct_source(kind: str, values: Mapping[str, Any], name: str) -> str:
    """The definition in C of a struct of the core's tables, such as `rumo_problem`, and of the arrays it points to."""
    definitions: list[str] = []

    def array(key: str) -> str:
        if values[key].size == 0:  # C has no empty arrays
            return "NULL"
        definitions.append(array_source(f"{name}_{key}", values[key]))
        return f"{name}_{key}"

    def struct(table: str, prefix: str, depth: int) -> str:
        indent, lines = "    " * depth, ""
        for member, of, *_ in TABLES[table]:
            key = prefix + member
            if of in TABLES:
                value = struct(of, part_prefix(prefix, member), depth + 1)
            else:
                value = str(int(values[key])) if of == "count" else array(key)
            lines += f"{indent}    .{member} = {value},\n"
        return f"{{\n{lines}{indent}}}"

    body = struct(kind, "", 0)
    return f"{''.join(definitions)}\nstatic const {kind} {name} = {body};\n"


def _number(value: float) -> str:
    if isinstance(value, float) and not np.isfinite(value):
        return "NAN" if np.isnan(value) else "INFINITY" if value > 0.0 else "-INFINITY"
    return repr(int(value) if isinstance(value, bool) else value)
