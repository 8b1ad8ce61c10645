"""Problems as C headers for the tests of the core: made at run time, so that they never differ from the package."""

import dataclasses
from dataclasses import dataclass

import numpy as np
from problems import cooled_reactor, pendulum, stiff_reactor, swinging_cart, tank

import rumo
from rumo.controllers.engines.described import core_problem
from rumo.kernel import describe, describe_system, problem_source
from rumo.kernel.description import MATRICES, NUMBERS, SIZES, Description, StageProgram, members
from rumo.kernel.elimination import Equations, eliminate
from rumo.kernel.export import array_source, struct_source
from rumo.kernel.factor import factor
from rumo.kernel.straight import elimination_source
from rumo.kernel.tailored import model_source
from rumo.kernel.tape import Tape
from rumo.recording import system_program
from rumo.references import SinePath
from rumo.registry import MODELS
from rumo.studies import PaperStudy
from rumo.textbook import heat_rod, robertson_dae
from rumo.transcription import Transcription
from rumo.vehicles import PAPER_CAR, friction_circles

PERIOD = 0.04


@dataclass(frozen=True)
class Fixture:
    """A problem, a state to start from, and the reference at each sample: k -> (N + 1, ny)."""

    problem: rumo.Problem
    x: list[float]
    reference: object
    scheme: rumo.Discretization = dataclasses.field(default_factory=rumo.ImplicitEuler)
    solver: str = "auto"
    record: str = "reference"  # whose plans are recorded


def paper_car(penalty, delay, **changes):
    """The paper's car; the longer the delay, the narrower the bends."""
    path = SinePath(3.0, wavelength=60.0 / (1.0 + 0.6 * delay), speed=8.0, vehicle=PAPER_CAR)
    study = PaperStudy(path=path, penalty=penalty, delay=delay)
    problem = study.problem()
    if changes:
        problem = rumo.Problem(
            problem.model,
            sampling_time=PERIOD,
            delay=delay,
            track={
                name: rumo.Weight(1.0, span)
                for name, span in zip(problem.outputs, (160.0, 6.0, 0.6, 10.0), strict=True)
            },
            moves={"torque": rumo.Weight(5.0, range=600.0), "steering_rate": rumo.Weight(5.0, range=3.0)},
            bounds={"torque": (-300.0, 300.0), "steering_rate": (-1.5, 1.5)},
            constraints=friction_circles(PAPER_CAR, penalty),
            **({"horizon": study.horizon} | changes),
        )

    def reference(k):
        window = study.path(PERIOD * k + problem.times)
        return np.column_stack([window[name] for name in problem.outputs])

    start = study.path(np.zeros(1))
    x = {name: float(values[0]) for name, values in start.items()} | {"p_y": 0.6, "v_y": 0.05, "omega": 0.02}
    return Fixture(problem, [x[name] for name in problem.model.states], reference)


def held(problem, x, *levels):
    """A reference that jumps between levels."""

    def reference(k):
        return np.tile(levels[k // 15 % len(levels)], (problem.horizon + 1, 1))

    return Fixture(problem, x, reference)


def contradictory():
    """Hard limits that leave nothing: every QP is infeasible."""
    problem = pendulum(
        bounds={"torque": (-2.0, 1.5), "angle": (-1.0, 1.0)},
        constraints={"other_side": rumo.Constraint(lambda x, u, p: 1.5 - x.angle)},
        move_bounds={"torque": (-0.5, 0.4)},
        delay=2,
    )
    return held(problem, [0.1, 0.0], [0.0], [0.5])


def falling():
    """An unstable plant over so long a horizon that condensing leaves nothing of its Hessian: the core knows it."""
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": 5.0 * x.x + u.u})
    problem = rumo.Problem(
        model,
        horizon=60,
        sampling_time=0.1,
        track={"x": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(0.1, range=2.0)},
        bounds={"u": (-1.0, 1.0)},
    )
    fixture = held(problem, [0.1], [0.0], [0.1])
    return dataclasses.replace(fixture, scheme=rumo.Radau2(), solver="condensing", record="portable")


def bare():
    """No bounds, no constraints, no delay, one interval."""
    return held(pendulum(bounds={}, delay=0, horizon=1), [0.1, 0.0], [0.0], [1.0])


def algebraic():
    """Robertson's reaction with an algebraic variable that is tracked and limited."""
    problem = rumo.Problem(
        robertson_dae(),
        horizon=10,
        sampling_time=2.0,
        delay=1,
        track={"c": rumo.Weight(1.0, range=0.5)},
        moves={"dilution": rumo.Weight(0.01, range=0.1)},
        bounds={"dilution": (0.0, 0.05), "c": rumo.Bounds(upper=0.17, penalty=rumo.Penalty(0.5))},
    )
    return held(problem, [0.8, 2.6e-5], [0.16], [0.19])


def fixtures():
    """All of them, by name."""
    soft = rumo.Penalty(l1=1.0)
    cart, x_cart, _ = swinging_cart()
    reactor, x_reactor, _ = stiff_reactor()
    hot, x_hot, _ = cooled_reactor()
    cars = {
        f"car_{kind}_{delay}": paper_car(penalty, delay)
        for kind, penalty in (("soft", soft), ("hard", None))
        for delay in range(4)
    }
    return cars | {
        "car_moves": paper_car(soft, 1, move_bounds={"torque": (-60.0, 90.0), "steering_rate": (-0.3, 0.3)}),
        "car_late": paper_car(soft, 1, measurements={"p_x": rumo.Measurement(age=2), "psi": rumo.Measurement(age=1)}),
        "cart": held(cart, x_cart, [0.0, 0.0], [0.5, 0.0]),
        "reactor": held(reactor, x_reactor, [0.84], [0.79]),
        "hot": held(hot, x_hot, [1.11], [1.0]),
        "tank": held(tank(), [1.0], [1.2], [0.4]),
        "car_radau": dataclasses.replace(paper_car(soft, 1), scheme=rumo.Radau2()),
        "car_substeps": dataclasses.replace(paper_car(soft, 2), scheme=rumo.Bdf2(substeps=2)),
        "car_growing": paper_car(soft, 1, horizon=rumo.Grid.geometric(10, PERIOD, 1.2, equal=2)),
        "car_blocks": paper_car(
            soft,
            2,
            blocks=rumo.IncrementBlocks([2, 3, 8]),
            move_bounds={"torque": (-60.0, 90.0), "steering_rate": (-0.3, 0.3)},
        ),
        "car_held": paper_car(None, 0, blocks=rumo.InputBlocks([1, 2, 12])),
        "cart_explicit": dataclasses.replace(held(cart, x_cart, [0.0, 0.0], [0.5, 0.0]), scheme=rumo.Rk4(substeps=3)),
        "algebraic": dataclasses.replace(algebraic(), scheme=rumo.Trapezoidal(substeps=2)),
        "contradictory": contradictory(),
        "falling": falling(),
        "car_condensed": dataclasses.replace(paper_car(soft, 1), solver="condensing"),
        "hot_condensed": dataclasses.replace(held(hot, x_hot, [1.11], [1.0]), solver="condensing"),
        "bare": bare(),
        "car_one": paper_car(soft, 0, horizon=1),
    }


def description_of(fixture):
    """What the core is told about a problem."""
    return core_problem(Transcription(fixture.problem, fixture.scheme), fixture.solver)


def tailored_model(fixture):
    """What a tailored build of the core is compiled with: definitions, and the model as C."""
    description = description_of(fixture)
    sizes = ", ".join(str(size) for size in description.sizes)
    defines = f'#define RUMO_TAILORED\n#define RUMO_SIZES {sizes}\n#define RUMO_EVALUATE "model.h"\n'
    return defines, model_source(description)


def recorded(fixture, samples, seed=0):
    """A loop closed with the predicted state and some noise: x, references, applied inputs, numbers, statuses."""
    problem = fixture.problem
    qp = rumo.QpOptions(solver=fixture.solver)
    controller = rumo.RealTimeIteration(problem, fixture.scheme, qp=qp, backend=fixture.record, trusted_step=np.inf)
    rng = np.random.default_rng(seed)
    x = np.array(fixture.x)
    rows = []
    for k in range(samples):
        reference, applied = fixture.reference(k), controller.applied
        plan = controller.step(x, reference)
        numbers = plan._numbers.copy()
        rows.append((x.copy(), reference, applied, numbers, list(rumo.Status).index(plan.status)))
        predicted = plan.x.values[1]
        if np.isfinite(predicted).all():
            x = predicted * (1.0 + 1e-3 * rng.standard_normal(len(x)))
    return [np.array(column) for column in zip(*rows, strict=True)]


def fixture_header(chosen, samples):
    """The header fixtures.h: every problem, its record, and the table of all."""
    parts, rows = ['#include "fixture.h"\n'], []
    for name, fixture in chosen.items():
        parts.append(problem_source(description_of(fixture), name))
        arrays = dict(zip(("x", "reference", "told", "numbers", "status"), recorded(fixture, samples), strict=True))
        parts += [array_source(f"{name}_{key}_recorded", array) for key, array in arrays.items()]
        rows.append(
            f'    {{"{name}", &{name}, {samples}, ' + ", ".join(f"{name}_{key}_recorded" for key in arrays) + "},\n"
        )
    parts.append(f"static const fixture fixtures[] = {{\n{''.join(rows)}}};\nenum {{ FIXTURES = {len(rows)} }};\n")
    return "\n".join(parts)


STARTS = {
    "v_x": 8.0,
    "t_": 60.0,
    "c_": 900.0,
    "p_": 60.0,
    "w_": 24.0,
    "a": 0.8,
    "b": 2e-5,
    "position": 1.5,
    "angle": 0.3,
}
"""Of states whose names begin so: where models are used."""


def mixed(n=7):
    """A system in which everything depends on everything: dense factors."""
    names = [f"x{i}" for i in range(n)]
    return rumo.Model(
        dict.fromkeys(names, "1"),
        {"push": "1"},
        lambda x, u, p: {
            name: -(10.0**i) * x[name] + sum(x[other] * (j - i) for j, other in enumerate(names)) / n + u.push
            for i, name in enumerate(names)
        },
        name="mixed",
    )


def unstable(n=9):
    """A system whose modes grow, most of them in pairs, and whose Jacobian varies."""
    names = [f"x{i}" for i in range(n)]
    return rumo.Model(
        dict.fromkeys(names, "1"),
        {"push": "1"},
        lambda x, u, p: {
            name: 0.5 * x[name]
            - 0.1 * x[name] ** 3
            + sum(x[other] * (j - i) for j, other in enumerate(names)) / n
            + u.push
            for i, name in enumerate(names)
        },
        name="unstable",
    )


def system_header():
    """The header systems.h: systems to integrate, with states to start from and default parameters."""
    models = {name: make() for name, make in MODELS.items()} | {
        "long_rod": heat_rod(60),
        "mixed": mixed(),
        "unstable": unstable(),
    }
    parts, rows = ['#include "rumo_core.h"\n'], []
    for name, model in models.items():
        values = describe_system(system_program(model), np.ones(len(model.variables)), model.algebraic_guess, 1e-9)
        x = [next((value for key, value in STARTS.items() if state.startswith(key)), 0.1) for state in model.states]
        arrays = {"x": np.array(x), "p": np.append(model.default_parameters, 0.0)}
        parts.append(struct_source("rumo_system", values, f"system_{name}"))
        parts += [array_source(f"{name}_{key}", array) for key, array in arrays.items()]
        rows.append(f'    {{"{name}", &system_{name}, ' + ", ".join(f"{name}_{key}" for key in arrays) + "},\n")
    parts.append(
        f"""\
typedef struct system_of {{
    const char *name;
    const rumo_system *system;
    const double *x, *p;
}} system_of;
static const system_of systems[] = {{\n{"".join(rows)}}};
enum {{ SYSTEMS = {len(rows)} }};
"""
    )
    return "\n".join(parts)


def pattern_header(count=32, seed=1):
    """The header patterns.h: equations of random sparsity, in problems that have nothing else.

    Small ones, a quarter of them with sparse blocks, and their elimination as straight lines; and wide ones.
    """
    rng = np.random.default_rng(seed)
    small, wide = [], []
    for index in range(count):
        sparse = index % 4 == 3
        nx = 24 if sparse else int(rng.integers(1, 11))
        # From triangular to one block of all; diagonals need not be there, but something must be to pivot on.
        pattern = rng.random((nx, nx)) < (0.06 if sparse else rng.choice([0.1, 0.3, 0.9]))
        pattern |= np.eye(nx, dtype=bool)[rng.permutation(nx)] if index % 8 > 3 else np.eye(nx, dtype=bool)
        small.append(_of_pattern(rng, pattern, sparse))
    for index, nx in enumerate((1, 2, 9, 30, 40, 50, 60)):
        distance = np.abs(np.subtract.outer(np.arange(nx), np.arange(nx)))
        pattern = (distance <= 1 + index % 2) | (rng.random((nx, nx)) < 0.3 / nx)
        if index == 3:  # a hub
            pattern[0] = pattern[:, 0] = True
        if index > 4:  # no diagonal to pivot on, as where algebraic equations are
            pattern = pattern[rng.permutation(nx)]
        wide.append(_of_pattern(rng, pattern))
    parts = [
        """\
#include "rumo_core.h"
typedef struct pattern {
    const rumo_problem *problem;
    int (*straight)(double, const double *restrict, double *restrict, double *restrict);
} pattern;
"""
    ]
    parts += [problem_source(values, f"pattern_{index}") for index, values in enumerate(small)]
    parts.append("#ifndef WITHOUT_STRAIGHT_LINES\n#define STRAIGHT(name) name")
    parts += [elimination_source(of.values, f"straight_{index}", 8) for index, of in enumerate(small)]
    parts.append("#else\n#define STRAIGHT(name) NULL\n#endif")
    parts += [problem_source(values, f"wide_{index}") for index, values in enumerate(wide)]
    rows = ", ".join(f"{{&pattern_{index}, STRAIGHT(straight_{index})}}" for index in range(count))
    parts.append(f"static const pattern patterns[] = {{{rows}}};\nenum {{ PATTERNS = {count} }};\n")
    rows = ", ".join(f"&wide_{index}" for index in range(len(wide)))
    parts.append(f"static const rumo_problem *const wide_patterns[] = {{{rows}}};\n")
    parts.append(f"enum {{ WIDE_PATTERNS = {len(wide)} }};\n")
    return "\n".join(parts)


def _of_pattern(rng, pattern, sparse=False):
    """A problem whose matrix M has a pattern, with tables of both ways to solve it; `sparse` where that pays at all."""
    nx, nu = len(pattern), int(rng.integers(1, 4))
    shapes = {"M": pattern, "A0": rng.random((nx, nx)) < 0.4, "B": rng.random((nx, nu)) < 0.5}
    positions = {key: [] for key in MATRICES} | {
        key: [(int(r), int(c)) for r, c in np.argwhere(shape)] for key, shape in shapes.items()
    }
    first, slots = {"y": 0, "G": 0, "defect": 0}, nx
    for key in MATRICES:
        first[key], slots = slots, slots + len(positions[key])
    tape = Tape(np.zeros((0, 4), dtype=np.int32), np.zeros(0), 1)
    sizes = dict.fromkeys(SIZES[:-1], 0) | {"horizon": 8, "states": nx, "inputs": nu, "substeps": 1}
    sizes["shift_same_rows"] = 1
    # Only lengths matter: what is eliminated has no other numbers.
    arrays = [member.name for member in members("rumo_problem") if member.kind in ("ints", "doubles")]
    given = ("shift_", "blocking_", "inner_signals", "inner_nodes", "algebraic_guess", "imposed", *NUMBERS)
    empty = {key: np.zeros(0) for key in arrays if key.startswith(given)}
    empty |= {key: np.zeros((8, nu)) for key in ("input_lower", "input_upper")}
    stage = StageProgram(tape, None, np.zeros(slots), first, positions, lambda: np.zeros((0, nx, nx)))
    description: Description = describe(stage, sizes, empty)
    equations = Equations(first, positions, nx, nx, nu)
    equations.sparse = [
        sparse and block.pays(len(c)) for block, c in zip(equations.blocks, equations.columns, strict=True)
    ]
    tables = eliminate(equations, stage.samples) | factor(equations.blocks, equations.left)
    inner = len(tables["factor_entry"])
    description.values.update(tables)
    description.values.update(
        {
            "factor_unknowns": nx,
            "factor_blocks": len(equations.blocks),
            "factor_outer": len(tables["factor_nonzero"]) - inner,
            "factor_inner": inner,
            "elimination_blocks": len(tables["elimination_size"]),
            "elimination_entries": len(tables["elimination_row"]),
        }
    )
    return description
