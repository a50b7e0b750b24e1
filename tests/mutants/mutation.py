"""Makes the mutants of one module: its source with one expression or statement changed, and a name that stays valid
when lines move."""

from __future__ import annotations

import ast
import contextlib
import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from operators import operator_named
from parso.tree import NodeOrLeaf

ROOT = Path(__file__).parents[2]
Name = tuple[str, str, str, str]


@dataclass(frozen=True, slots=True)
class Mutant:
    """``original`` and ``mutated`` are the changed lines without their indentation; with ``module`` and ``function``
    they are its name. ``line`` is for the reader alone."""

    module: str
    function: str
    original: str
    mutated: str
    line: int
    source: str

    @property
    def name(self) -> Name:
        return self.module, self.function, self.original, self.mutated


def mutants_of(module: str, operators: Iterable[str], root: Path = ROOT) -> list[Mutant]:
    """All mutants of the file ``module``, in the order of its lines; each differs from the others as a program."""
    code = (root / module).read_text()
    tree, seen = get_ast(code), {ast.dump(ast.parse(code))}
    nodes = [node for node in ast_nodes(tree) if not _is_only_read(node)]
    found = []
    for operator in map(operator_named, operators):
        for node in nodes:
            for index in range(len(list(operator.mutation_positions(node)))):
                with _restored(node):
                    _replace(node, operator.mutate(node, index))
                    source = tree.get_code()
                try:
                    meaning = ast.dump(ast.parse(source))
                except SyntaxError:  # no program, so nothing to test
                    continue
                if meaning not in seen:
                    seen.add(meaning)
                    found.append(_mutant(module, node, code, source))
    return sorted(found, key=lambda mutant: mutant.line)


@contextlib.contextmanager
def _restored(node: NodeOrLeaf) -> Iterator[None]:
    """The tree is parsed once: what an operator changes, at most two levels down, is put back."""
    near = [node.parent or node, node, *(below for child in _children(node) for below in (child, *_children(child)))]
    before = [(one, getattr(one, "value", None), list(_children(one))) for one in near]
    yield
    for one, value, children in before:
        if value is not None:
            one.value = value
        if children:
            one.children = children


def _replace(node: NodeOrLeaf, mutated: NodeOrLeaf) -> None:
    if mutated is not node:
        siblings = node.parent.children
        node.parent.children = [mutated if one is node else one for one in siblings]


def _children(node: NodeOrLeaf) -> list[NodeOrLeaf]:
    return getattr(node, "children", [])


def _is_only_read(node: NodeOrLeaf) -> bool:
    """Annotations and ``Literal[…]`` are for the type checker; a constant's reason stands beside it, and a test that
    repeats the number proves nothing; imports, decorators and the star among parameters decide nothing."""
    if node.type == "number" and _is_constant(node):
        return True
    if node.type == "operator" and node.parent is not None and node.parent.type in ("parameters", "param"):
        return True
    while node.parent is not None:
        parent = node.parent
        if parent.type == "annassign" and node is parent.children[1]:
            return True
        if parent.type == "tfpdef" or (parent.type == "funcdef" and node.get_previous_sibling() == "->"):
            return True
        if parent.type == "atom_expr" and parent.children[0].get_code().strip() in ("Literal", "TypeVar", "cast"):
            return True
        if parent.type == "argument" and parent.children[0].get_code().strip() == "strict":
            return True  # of zip(): it guards what the lines before have made sure
        if parent.type in ("import_name", "import_from", "decorator"):
            return True
        if parent.type == "if_stmt" and parent.children[1].get_code().strip() == "TYPE_CHECKING":
            return True
        if parent.type == "expr_stmt" and parent.children[0].get_code().strip() in ("__all__", "__slots__"):
            return True
        node = parent
    return False


def _is_constant(node: NodeOrLeaf) -> bool:
    """In ``NAME = …`` of the module."""
    while node.parent is not None and node.parent.type != "file_input":
        node = node.parent
    return node.type == "simple_stmt" and node.children[0].type == "expr_stmt"


def _mutant(module: str, node: NodeOrLeaf, code: str, source: str) -> Mutant:
    before, after = code.splitlines(), source.splitlines()
    first = _same(before, after)
    last = _same(before[:first:-1], after[:first:-1])
    original, mutated = before[first : len(before) - last], after[first : len(after) - last]
    return Mutant(module, _function_of(node), _text(original), _text(mutated), first + 1, source)


def _same(lines: list[str], others: list[str]) -> int:
    """How many lines both begin with."""
    return len(list(itertools.takewhile(lambda pair: pair[0] == pair[1], zip(lines, others, strict=False))))


def _text(lines: list[str]) -> str:
    return " ".join(line.strip() for line in lines)


def _function_of(node: NodeOrLeaf | None) -> str:
    names: list[str] = []
    while node is not None:
        if node.type in ("funcdef", "classdef"):
            names.insert(0, node.name.value)
        node = node.parent
    return ".".join(names)
