"""Declares the checks that a distribution adds to ``mosaic doctor``: an entry point of the group ``mosaic.doctor``.

Its name is the group of the findings, its value an ``async def`` generator that takes a :class:`CheckContext` and
yields findings::

    async def examine(context: CheckContext) -> AsyncIterator[Finding]:
        for one in context.of_types("gripper"):
            yield passed(f"gripper.{one.label}", f"{one.label}: the gripper answers.")

It runs on the event loop beside all other checks and has :attr:`CheckContext.timeout_s`; whatever blocks belongs on a
thread (``asyncio.to_thread``). It changes nothing on the machine. An exception becomes a finding and stops nobody.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from mosaic_core.words.finding import Finding

__all__ = ["Check", "CheckContext", "NamedConnector"]

CHECKS_GROUP = "mosaic.doctor"


@dataclass(frozen=True, slots=True)
class NamedConnector:
    """One connector of the robot's YAML file whose params are valid."""

    type: str
    label: str
    params: Any
    """The ``Params`` of its own configurer."""


@dataclass(frozen=True, slots=True)
class CheckContext:
    """The configuration that a check may look at. Without a YAML file there are no connectors."""

    connectors: tuple[NamedConnector, ...] = ()
    config_path: Path | None = None
    timeout_s: float = 8.0

    def of_types(self, *types: str) -> tuple[NamedConnector, ...]:
        """The connectors of these types."""
        return tuple(one for one in self.connectors if one.type in types)


Check: TypeAlias = Callable[[CheckContext], AsyncIterator[Finding]]
"""The object that the entry point names."""
