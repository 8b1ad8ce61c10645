"""A tape made faster: fewer divisions, and instructions of one kind in a row."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from rumo.kernel.tape import OPERATIONS, Tape

_CONSTANT, _INPUT, _OUTPUT, _MUL, _DIV, _INV = (
    OPERATIONS.index(name) for name in ("constant", "input", "output", "mul", "div", "inv")
)


class Instruction(NamedTuple):
    """An instruction of a program in which each makes a number of its own, named by its position.

    `a` and `b` are such numbers, but what the tape says for inputs; `slot` is that of an output.
    """

    operation: int
    slot: int
    a: int
    b: int
    constant: float

    @property
    def operands(self) -> Sequence[int]:
        """Numbers that it needs."""
        if self.operation in (_CONSTANT, _INPUT):
            return ()
        return (self.a,) if self.a == self.b else (self.a, self.b)

    def using(self, place: Sequence[int]) -> Instruction:
        """The same where its operands are in other places."""
        return self._replace(a=place[self.a], b=place[self.b]) if self.operands else self


Program = list[Instruction]


def optimised(tape: Tape) -> Tape:
    """A tape with the same results but for rounding."""
    return _allocated(_in_runs(_with_reciprocals(_numbered(tape))))


def _numbered(tape: Tape) -> Program:
    """The program of a tape, without registers."""
    number = [0] * tape.registers
    program: Program = []
    for (operation, result, a, b), constant in zip(tape.code.tolist(), tape.constants.tolist(), strict=True):
        if operation == _OUTPUT:
            program.append(Instruction(operation, result, number[a], number[a], constant))
        else:
            step = Instruction(operation, 0, a, b, constant)
            program.append(step.using(number))
            number[result] = len(program) - 1
    return program


def _with_reciprocals(program: Program) -> Program:
    """Divisions by a constant, or several by the same number, as products with its reciprocal.

    A division takes as long as ten products, and derivatives of quotients divide by the same number again and again.
    """
    divisors = Counter(_divisor(step) for step in program if step.operation in (_DIV, _INV))
    made: Program = []
    place: list[int] = []
    reciprocals: dict[int, int] = {}
    for step in program:
        divisor = _divisor(step) if step.operation in (_DIV, _INV) else None
        if divisor is not None and divisor not in reciprocals:
            of = program[divisor]
            if of.operation == _CONSTANT and of.constant and np.isfinite(1.0 / of.constant):
                made.append(of._replace(constant=1.0 / of.constant))
                reciprocals[divisor] = len(made) - 1
            elif divisors[divisor] > 1:
                made.append(Instruction(_INV, 0, place[divisor], place[divisor], 0.0))
                reciprocals[divisor] = len(made) - 1
        if divisor not in reciprocals:
            made.append(step.using(place))
        elif step.operation == _DIV:
            made.append(Instruction(_MUL, 0, place[step.a], reciprocals[divisor], 0.0))
        else:
            place.append(reciprocals[divisor])
            continue
        place.append(len(made) - 1)
    return made


def _divisor(step: Instruction) -> int:
    return step.b if step.operation == _DIV else step.a


def _in_runs(program: Program) -> Program:
    """The same with instructions of one kind next to each other: the core decides once what to do for all of a run."""
    waiting: list[list[int]] = [[] for _ in program]
    ready: dict[int, list[int]] = {step.operation: [] for step in program}
    for i, step in enumerate(program):
        for operand in step.operands:
            waiting[operand].append(i)
        if not step.operands:
            ready[step.operation].append(i)
    missing = [len(step.operands) for step in program]
    ordered: Program = []
    place = [0] * len(program)
    while any(ready.values()):
        run = max(ready.values(), key=len)
        while run:
            i = heappop(run)
            place[i] = len(ordered)
            ordered.append(program[i].using(place))
            for j in waiting[i]:
                missing[j] -= 1
                if not missing[j]:
                    heappush(ready[program[j].operation], j)
    return ordered


def _allocated(program: Program) -> Tape:
    """A program as a tape: what nothing needs left out, registers taken again after the last use of their number."""
    last_use = [-1] * len(program)
    for i in reversed(range(len(program))):
        if program[i].operation == _OUTPUT or last_use[i] >= 0:
            for operand in program[i].operands:
                last_use[operand] = max(last_use[operand], i)
    register = [0] * len(program)
    free: list[int] = []
    registers = 0
    code: list[tuple[int, int, int, int]] = []
    constants: list[float] = []
    for i, step in enumerate(program):
        if step.operation != _OUTPUT and last_use[i] < 0:
            continue
        free += [register[operand] for operand in step.operands if last_use[operand] == i]
        held = step.using(register)
        if step.operation == _OUTPUT:
            code.append((step.operation, step.slot, held.a, 0))
        else:
            if not free:
                free.append(registers)
                registers += 1
            register[i] = free.pop()
            code.append((step.operation, register[i], held.a, held.b))
        constants.append(step.constant)
    return Tape(np.array(code, dtype=np.int32).reshape(-1, 4), np.array(constants), max(registers, 1))
