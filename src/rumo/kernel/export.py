"""A problem as C: constant tables by the names of rumo_core.h, for programs that run without Python."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np

from rumo.kernel.description import MATRICES, VECTORS, Description

_ELIMINATION = {
    "size": "block_size",
    "width": "block_width",
    "loads": "block_loads",
    "updates": "block_updates",
    "stores": "block_stores",
    "unknowns": "block_unknowns",
    "load": "load",
    "update": "update",
    "store": "store",
    "row": "result_row",
    "column": "result_column",
}
"""Members of `rumo_elimination`, and what a description calls them."""

_COMPOSITION = ("row", "column", "start", "own", "products", "product")
"""Members of `rumo_composition`."""

ARRAYS = (
    "fixed",
    "inner_signals",
    "inner_nodes",
    "algebraic_guess",
    "output_weights",
    "move_weights",
    "input_scales",
    "input_lower",
    "input_upper",
    "move_lower",
    "move_upper",
    "block_lower",
    "block_upper",
    "safe_input",
    "constraint_scales",
    "l1",
    "l2",
    "imposed",
)
"""Arrays of `rumo_problem` that a description has by the same name."""


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
    values = description.values
    definitions: list[str] = []

    def array(key: str) -> str:
        if values[key].size == 0:  # C has no empty arrays
            return "NULL"
        definitions.append(array_source(f"{name}_{key}", values[key]))
        return f"{name}_{key}"

    def pattern(key: str) -> str:
        count, first = len(values[f"{key}_row"]), values[f"{key}_first"]
        return f"{{{count}, {first}, {array(f'{key}_row')}, {array(f'{key}_column')}}}"

    def tape(prefix: str) -> str:
        code, constants = array(f"{prefix}code"), array(f"{prefix}constants")
        return f"{{{len(values[f'{prefix}code'])}, {values[f'{prefix}registers']}, {code}, {constants}}}"

    def struct(members: Mapping[str, object]) -> str:
        return "{\n" + "".join(f"        .{key} = {value},\n" for key, value in members.items()) + "    }"

    elimination = {"blocks": len(values["block_size"]), "entries": len(values["result_row"])}
    elimination |= {member: array(key) for member, key in _ELIMINATION.items()}
    composition = {"entries": len(values["composition_row"])}
    composition |= {member: array(f"composition_{member}") for member in _COMPOSITION}
    shift = {member: array(f"shift_{member}") for member in ("stages", "shares", "intervals")}
    shift["same_rows"] = str(values["shift_same_rows"])
    blocking = {member: array(f"blocking_{member}") for member in ("block", "share", "part")}
    members = {
        "sizes": f"{{{', '.join(str(size) for size in description.sizes)}}}",
        "tape": tape(""),
        "inner_tape": tape("inner_"),
        **{key: pattern(key) for key in MATRICES},
        **{key: str(values[f"{key}_first"]) for key in VECTORS},
        "elimination": struct(elimination),
        "composition": struct(composition),
        "shift": struct(shift),
        "blocking": struct(blocking),
        **{key: array(key) for key in ARRAYS},
        "parameters": array("parameter_values"),
    }
    body = "".join(f"    .{member} = {value},\n" for member, value in members.items())
    guard = f"{name.upper()}_H"
    return f"""\
/* A problem of model predictive control, made by Rumo: hand it to the core's create(). */
#ifndef {guard}
#define {guard}

#include <math.h>
#include <stddef.h>

#include "rumo_core.h"

{"".join(definitions)}
static const rumo_problem {name} = {{
{body}}};

#endif
"""


def _number(value: float) -> str:
    if isinstance(value, float) and not np.isfinite(value):
        return "NAN" if np.isnan(value) else "INFINITY" if value > 0.0 else "-INFINITY"
    return repr(int(value) if isinstance(value, bool) else value)
