"""Writes errors to a terminal: place, the line itself, what was expected, what to do. Never a traceback, and nothing
that a stranger's file or server says begins a line or acts on the terminal."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import typer

from mosaic_core.words.errors import CodeLine, ConfigError, MosaicError, PluginError, Problem, hint_at, without_place

FINE, FAILED, USAGE, REPLACED = 0, 1, 2, 3
"""Exit codes of every command: 2 is usage or configuration, 3 a robot that gave way to another of the same id, 1 the
rest. Neither 2 nor 3 is mended by a new start."""

_WRONG_WORDS = ("plugin.name", "plugin.not_found")
"""Codes of what somebody typed, beside those of configurations."""

_SECRET = re.compile(r"(?:token|credential|password|secret|api_key)[\"']?\s*:\s*(?!\{)(?=\S)", re.IGNORECASE)
_IN_FLOW = re.compile(r"""\"(?:[^"\\]|\\.)*\"?|'(?:[^']|'')*'?|(?:\$\{[^}]*\}|[^,}\]])+(?<=\S)""")
"""A value within braces or brackets: quoted, or up to what ends it there. Elsewhere it takes the rest of the line."""
_VARIABLE = re.compile(r"""(["']?)\$\{[^}]*\}\1(?=[\s,}\]]|$)""")
"""A value that stands elsewhere."""


def usage(message: str, cure: str = "") -> NoReturn:
    """Say what is wrong with the words, and end."""
    typer.secho(f"error: {_on_one_line(message)}", err=True, fg=typer.colors.RED)
    if cure:
        typer.echo(f"  cure: {_on_one_line(cure)}", err=True)
    raise typer.Exit(USAGE)


def need_known(what: str, name: str, known: Sequence[str]) -> None:
    """End unless ``name`` is one of ``known``, naming the nearest."""
    if name not in known:
        usage(f"no {what} {name!r}{hint_at(name, known)} There are: {', '.join(known)}")


def exit_code_of(error: MosaicError) -> int:
    """As a process tells whoever started it, a service manager for one, whether to start it again."""
    if error.code == "signal.replaced":
        return REPLACED
    is_usage = isinstance(error, ConfigError | PluginError) or error.code in _WRONG_WORDS
    return USAGE if is_usage or error.code.startswith("config.") else FAILED


def report(error: MosaicError) -> None:
    """Write ``error`` to stderr."""
    if isinstance(error, ConfigError):
        report_problems(error.problems)
        return
    said = without_place(error.message, error.at)
    said = said.removesuffix(error.cure).rstrip(" ;") if error.cure else said  # not twice
    typer.secho(f"error: {_on_one_line(said)}", err=True, fg=typer.colors.RED)
    if error.at.file:
        typer.echo(f"  --> {_on_one_line(str(error.at))}", err=True)
    typer.echo(f"  code: {error.code}", err=True)
    if error.cure:
        typer.echo(f"  cure: {_on_one_line(error.cure)}", err=True)


def report_problems(problems: Sequence[Problem], *, as_hints: bool = False) -> None:
    """Write problems, or hints, to stderr, each with the line of the file that it speaks of."""
    for problem in problems:
        _report_problem(problem, as_hints)
    if not as_hints:
        mistakes = "1 mistake" if len(problems) == 1 else f"{len(problems)} mistakes"
        typer.secho(f"{mistakes}; nothing was started", err=True, fg=typer.colors.RED)


def _report_problem(problem: Problem, is_hint: bool) -> None:
    place = str(CodeLine(problem.file, problem.line))
    word, color = ("hint", typer.colors.YELLOW) if is_hint else ("error", typer.colors.RED)
    said = f"{problem.path}: {problem.message}" if problem.path else problem.message
    typer.echo(typer.style(f"{word}: ", fg=color) + typer.style(_on_one_line(said), bold=True), err=True)
    if place:
        code = "" if is_hint else f"  [{problem.code}]"
        typer.echo(f"  {typer.style('-->', dim=True)} {_on_one_line(place)}{code}", err=True)
    excerpt = _line_of(problem)
    if excerpt is not None:
        typer.echo(f"  {problem.line:>4} | {excerpt}", err=True)
    if problem.cure:
        typer.echo(f"       = {_on_one_line(problem.cure)}", err=True)


def _line_of(problem: Problem) -> str | None:
    """The line of the file, without what might be a secret in it."""
    if not problem.file or not problem.line:
        return None
    try:
        lines = Path(problem.file).read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError:
        return None
    if problem.line > len(lines):
        return None
    text = "".join(char if char.isprintable() else " " for char in lines[problem.line - 1])
    return _without_secrets(text)[:160].rstrip()


def _without_secrets(text: str) -> str:
    shown, at = "", 0
    while (found := _SECRET.search(text, at)) is not None:
        begins, is_in_flow = found.end(), "{" in text[: found.start()] or "[" in text[: found.start()]
        named = _VARIABLE.match(text, begins)
        value = named or (_IN_FLOW.match(text, begins) if is_in_flow else None)
        ends = value.end() if value is not None else len(text)
        shown += text[at:begins] + (text[begins:ends] if named is not None else "***")
        at = max(ends, begins)
    return shown + text[at:]


def _on_one_line(text: str) -> str:
    from mosaic_core.words.plain_text import on_one_line  # every command loads this module, few have anything to report

    return on_one_line(text)
