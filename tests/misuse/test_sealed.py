"""Attributes that an object does not know are refused."""

import inspect
import re
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Protocol

import pytest
from problems import pendulum

import rumo
from rumo.sealed import Sealed


class Base(Sealed, ABC):
    limit: float

    def __init__(self, width):
        """Set up."""
        self.width = width
        self.later()

    def later(self):
        self.prepared = False

    @property
    def area(self):
        return self.width**2

    @area.setter
    def area(self, value):
        self.width = value**0.5

    @abstractmethod
    def run(self): ...


class Own(Base):
    gain = 1.0
    bias: float

    @cached_property
    def twice(self):
        return 2.0 * self.gain

    def __init__(self, width, height):
        super().__init__(width)
        self.height = height

    def run(self):
        self._count = 1


class Plain(Base):
    def run(self): ...


def test_what_a_subclass_declares_is_known():
    own = Own(1.0, 2.0)
    own.width = own.height = own.gain = own.bias = own.limit = own.area = 4.0
    own.prepared = True
    own._private = 1
    own.run()
    assert own.width == 2.0


@pytest.mark.parametrize("thing", [Own(1.0, 2.0), Plain(1.0)], ids=lambda thing: type(thing).__name__)
def test_anything_else_raises_with_a_hint(thing):
    message = f"{type(thing).__name__}: got 'widht', expected one of "
    with pytest.raises(rumo.UnknownNameError, match=re.escape(message) + ".* Did you mean 'width'?"):
        thing.widht = 3.0
    assert not hasattr(thing, "widht")


def test_methods_are_neither_hidden_nor_deleted():
    controller = rumo.RealTimeIteration(pendulum(), backend="reference")
    message = r"RealTimeIteration\.step cannot be set\. Define another one in a subclass"
    with pytest.raises(AttributeError, match=message):
        controller.step = print
    with pytest.raises(AttributeError, match=r"Problem\.horizon cannot be deleted"):
        del controller.problem.horizon


def test_methods_of_ones_own_may_be_replaced():
    own = Own(1.0, 2.0)
    own.run = print
    own.twice = 3.0
    assert (own.run, own.twice) == (print, 3.0)


class Mixed:
    def __init__(self, width):
        self.width = width


class First(Mixed, Plain): ...


class Heard(Protocol):
    def hello(self) -> str: ...


class Second(Plain, Heard): ...


@pytest.mark.parametrize("kind", [First, Second])
def test_whoever_wrote_the_constructor(kind):
    thing = kind(1.0)
    assert thing.width == 1.0
    with pytest.raises(AttributeError):
        thing.widht = 3.0
    assert str(inspect.signature(kind)).startswith("(width")


def test_it_is_an_attribute_error_too():
    with pytest.raises(AttributeError):
        Plain(1.0).widht = 3.0


def test_a_constructor_keeps_its_signature_and_words():
    assert str(inspect.signature(Own)) == "(width, height)"
    assert Base.__init__.__doc__ == "Set up."


def test_a_failed_constructor_leaves_nothing_sealed():
    with pytest.raises(TypeError):
        Own(1.0)


def test_a_problem_knows_its_attributes():
    with pytest.raises(
        rumo.UnknownNameError, match=r"Problem: got 'horizn', expected one of .* Did you mean 'horizon'"
    ):
        pendulum().horizn = 3


@pytest.mark.parametrize("name", ["horizon", "parameters", "constraints", "uniform"])
def test_a_problem_cannot_be_changed_in_place(name):
    problem = pendulum()
    with pytest.raises(
        AttributeError, match=re.escape(f"Problem.{name} cannot be set. Write problem.changed(weights=..., bounds=...)")
    ):
        setattr(problem, name, 3)
    assert problem.horizon == 12


def test_subclasses_of_problem_declare_their_own():
    class Mine(rumo.Problem):
        def __init__(self, *arguments, **named):
            super().__init__(*arguments, **named)
            self.note = "mine"

    problem = pendulum()
    mine = Mine(
        problem.model,
        horizon=5,
        sampling_time=0.1,
        track={"angle": rumo.Weight(1.0)},
        moves={"torque": rumo.Weight(1.0)},
    )
    assert mine.note == "mine"
    with pytest.raises(AttributeError):
        mine.note = "yours"
