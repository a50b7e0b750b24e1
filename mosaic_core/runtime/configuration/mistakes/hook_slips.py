"""Finds functions of a hook plugin that were meant as hooks and that a robot would never call, or call in vain."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from types import FunctionType
from typing import Any

from mosaic_core.contract import hooks
from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.words.errors import guess

HOOKS = {name: its for name, its in vars(hooks).items() if name.startswith("mosaic_") and inspect.isfunction(its)}


def hook_slips(plugin: object, marks: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    """Name and mistake of each such function, with its line and the cure. ``marks``: what ``@hookimpl`` says above
    those that it marks, by their names."""
    for name in sorted({*marks, *(HOOKS.keys() & set(dir(plugin)))}):
        attribute = inspect.getattr_static(plugin, name, None)
        function = getattr(attribute, "__func__", attribute)
        if isinstance(function, FunctionType):
            slip = _slip(plugin, attribute, function, marks.get(name))
            if slip:
                yield name, f"{name}{standing_at(function)} {slip}"


def _slip(plugin: object, attribute: object, function: FunctionType, mark: Mapping[str, Any] | None) -> str:
    if mark is None:
        return "is not called: write @hookimpl above it"
    hook = mark.get("specname") or function.__name__
    if hook not in HOOKS:
        cure = guess(hook, HOOKS, f"there are {', '.join(HOOKS)}")
        return "" if mark.get("optionalhook") else f"is called by nobody, for there is no such hook: {cure}"
    if inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function):
        return "is an `async def`, which nobody would await: write `def`; what waits needs a task or a thread"
    if inspect.isgeneratorfunction(function):
        return "has a `yield`, so that nobody would run its body: write it without one"
    if isinstance(plugin, type) and attribute is function:
        return f"is a method of the class {plugin.__name__}, which is no object: let the entry point name an instance"
    return _unknown_argument(function, hook, is_bound=not isinstance(plugin, type) and _takes_self(plugin, attribute))


def _takes_self(plugin: object, attribute: object) -> bool:
    return not inspect.ismodule(plugin) and not isinstance(attribute, staticmethod)


def _unknown_argument(function: FunctionType, hook: str, *, is_bound: bool) -> str:
    """The first argument that the hook does not give and that needs a value."""
    given = list(inspect.signature(HOOKS[hook]).parameters)
    taken = list(inspect.signature(function).parameters.values())[1 if is_bound else 0 :]
    for one in taken:
        is_needed = one.default is one.empty and one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)
        if is_needed and one.name not in given:
            return f"takes '{one.name}', which its hook does not give: {guess(one.name, given, _has(given))}"
    return ""


def _has(given: list[str]) -> str:
    return f"it gives {', '.join(given)}"
