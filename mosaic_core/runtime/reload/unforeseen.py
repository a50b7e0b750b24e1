"""Turns whatever a plugin's code raises while a robot reads it anew into a mistake of that code, with file and line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from mosaic_core.runtime.threads.code_places import raised_at
from mosaic_core.runtime.threads.error_words import said_by
from mosaic_core.words.errors import ConfigError, Problem

T = TypeVar("T")


async def on_a_thread(work: Callable[[], T]) -> T:
    """What ``work`` returns, which blocks and runs code of plugins. Raises nothing but :class:`ConfigError`."""

    def caught() -> T:
        try:
            return work()
        except BaseException as error:  # even what would end a thread or a program ends neither here
            raise as_mistake(error) from error

    return await asyncio.to_thread(caught)


def as_mistake(error: BaseException, what: str = "nobody foresaw that this is raised") -> ConfigError:
    """The error itself if it tells mistakes already, else the one that an author finds by its line. ``what``: begins
    its sentence."""
    if isinstance(error, ConfigError):
        return error
    file, line = raised_at(error)
    message = f"{what}: {said_by(error)}"
    cure = "mend the line that it names; the next save tries again"
    return ConfigError([Problem(message, "config.broken_plugin", file=file, line=line, cure=cure)])
