"""Mutation operators that cosmic-ray lacks: decisions are also in what a function returns, hands on, leaves out and how
it spells a code."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from typing import Any

import parso
from cosmic_ray.operators.operator import Example, Operator
from cosmic_ray.plugins import get_operator
from parso.python.tree import Keyword, Name, PythonNode, ReturnStmt, String
from parso.tree import NodeOrLeaf

Span = tuple[tuple[int, int], tuple[int, int]]


def operator_named(name: str) -> Operator:
    """One of cosmic-ray's (``core/…``) or one of ours (``mosaic/…``)."""
    provider, _, own = name.partition("/")
    found: Operator = OWN[own]() if provider == "mosaic" else get_operator(name)()
    return found


class RemoveStatement(Operator):  # type: ignore[misc]
    """An assignment, a call, a raise inside a function is left out."""

    LEFT_OUT = ("expr_stmt", "atom_expr", "raise_stmt", "del_stmt", "await", "return_stmt")

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        if node.type == "simple_stmt" and _is_in_function(node) and self._can_go(node.children[0]):
            yield node.start_pos, node.end_pos

    def _can_go(self, statement: NodeOrLeaf) -> bool:
        if statement.type == "keyword":
            return statement.value == "return"
        return statement.type in self.LEFT_OUT and statement.type != "return_stmt"

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        node.children[0] = parso.parse(node.get_first_leaf().prefix + "pass")
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return (Example("def f():\n    x = 1\n", "def f():\n    pass\n"),)


class ReturnNone(Operator):  # type: ignore[misc]
    """A function returns nothing instead of what it found."""

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        if isinstance(node, ReturnStmt) and node.children[1].get_code().strip() not in ("None", "False", "[]"):
            yield node.children[1].start_pos, node.children[1].end_pos

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        node.children[1] = parso.parse(" None")
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return (Example("def f():\n    return 1\n", "def f():\n    return None\n"),)


class SwapIn(Operator):  # type: ignore[misc]
    """``in`` becomes ``not in`` and the other way round."""

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        if node.type == "comparison":
            for word in node.children[1::2]:
                if _words(word) in ("in", "not in"):
                    yield word.start_pos, word.end_pos

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        places = [place for place, word in enumerate(node.children) if _words(word) in ("in", "not in")]
        place = places[index]
        node.children[place] = parso.parse(" in" if _words(node.children[place]) == "not in" else " not in")
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return Example("x in y", "x not in y"), Example("x not in y", "x in y")


class SwapMinMax(Operator):  # type: ignore[misc]
    """``min`` becomes ``max``: a limit holds from the wrong side."""

    OTHER = {"min": "max", "max": "min", "any": "all", "all": "any"}  # noqa: RUF012

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        if isinstance(node, Name) and node.value in self.OTHER and _is_called(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        node.value = self.OTHER[node.value]
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return Example("min(x, y)", "max(x, y)"), Example("any(x)", "all(x)")


class SpoilWord(Operator):  # type: ignore[misc]
    """A code or another word that a program reads is misspelt. Sentences for people are left alone."""

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        if isinstance(node, String) and self._is_word(node):
            yield node.start_pos, node.end_pos

    def _is_word(self, node: String) -> bool:
        if node.parent is not None and node.parent.type == "simple_stmt":
            return False
        value = ast.literal_eval(node.value)
        return isinstance(value, str) and value != "" and not any(map(str.isspace, value))

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        node.value = repr("XX" + ast.literal_eval(node.value))
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return (Example("x = 'code'", "x = 'XXcode'"),)


class EmptyArgument(Operator):  # type: ignore[misc]
    """A call gets ``None`` where it got a value."""

    def mutation_positions(self, node: NodeOrLeaf) -> Iterator[Span]:
        for argument in self._arguments(node):
            yield argument.start_pos, argument.end_pos

    def _arguments(self, node: NodeOrLeaf) -> list[NodeOrLeaf]:
        if node.type != "trailer" or node.children[0].value != "(" or len(node.children) < 3:
            return []
        inner = node.children[1]
        parts = inner.children if inner.type == "arglist" else [inner]
        return [part for part in parts if self._is_value(part)]

    def _is_value(self, part: NodeOrLeaf) -> bool:
        if part.type == "argument":
            name, equals, *value = part.children
            return equals == "=" and name.value != "strict" and _is_something(value[0])
        return part.type not in ("operator", "strings") and _is_something(part)

    def mutate(self, node: NodeOrLeaf, index: int) -> NodeOrLeaf:
        chosen = self._arguments(node)[index]
        if chosen.type == "argument":
            chosen.children[2] = parso.parse("None")
            return node
        siblings = node.children[1].children if node.children[1].type == "arglist" else node.children
        empty = parso.parse(chosen.get_first_leaf().prefix + "None")
        siblings[next(place for place, part in enumerate(siblings) if part is chosen)] = empty
        return node

    @classmethod
    def examples(cls) -> Iterable[Example]:
        return Example("f(x, y)", "f(None, y)"), Example("f(a=x)", "f(a=None)")


def _is_in_function(node: NodeOrLeaf) -> bool:
    while node.parent is not None:
        node = node.parent
        if node.type in ("funcdef", "lambdef"):
            return True
        if node.type == "classdef":
            return False
    return False


def _is_called(node: Name) -> bool:
    following = node.get_next_sibling()
    return following is not None and following.type == "trailer" and following.children[0] == "("


def _is_something(value: NodeOrLeaf) -> bool:
    return value.get_code().strip() not in ("None", "False", '""')


def _words(node: NodeOrLeaf) -> str:
    if isinstance(node, Keyword | PythonNode):
        return " ".join(node.get_code(include_prefix=False).split())
    return ""


OWN: dict[str, Any] = {
    operator.__name__: operator
    for operator in (RemoveStatement, ReturnNone, SwapIn, SwapMinMax, SpoilWord, EmptyArgument)
}
