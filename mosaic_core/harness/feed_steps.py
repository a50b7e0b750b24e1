"""The steps of a script for a receiver, and what became of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from pydantic import BaseModel

from mosaic_core.contract.host import Sender

OPERATOR = Sender(peer_id="peer-1", session_id="session-1", operator_id="operator-1", name="Alice")
"""Who sends what a script does not attribute to somebody."""
ANOTHER_OPERATOR = Sender(peer_id="peer-2", session_id="session-2", operator_id="operator-2", name="Bob")
"""Somebody else, who says stop where a script does not say who."""


def _number(step: object, given: object) -> float:
    if isinstance(given, int | float):
        return given
    raise TypeError(f"{type(step).__name__} takes a number, not {given!r}")


def _check_sender(step: object, given: object) -> None:
    if not isinstance(given, Sender):
        raise TypeError(f"{type(step).__name__} takes a Sender, such as OPERATOR, not {given!r}")


@dataclass(frozen=True, slots=True)
class Silence:
    """A pause: nothing arrives for ``seconds``."""

    seconds: float
    """Of the fake clock."""

    def __post_init__(self) -> None:
        if not 0 <= _number(self, self.seconds) < math.inf:
            raise ValueError(f"Silence lasts 0 s or longer, not {self.seconds}")


@dataclass(frozen=True, slots=True)
class Leaves:
    """This operator's connection ends."""

    sender: Sender = OPERATOR
    """Who leaves."""

    def __post_init__(self) -> None:
        _check_sender(self, self.sender)


@dataclass(frozen=True, slots=True)
class From:
    """A message of ``sender``."""

    sender: Sender
    """Who sends it."""
    data: Any
    """A model, JSON values, or exactly these ``str`` or ``bytes``."""

    def __post_init__(self) -> None:
        _check_sender(self, self.sender)


@dataclass(frozen=True, slots=True)
class Stopped:
    """Somebody says stop; it holds until :class:`Cleared`."""

    by: Sender = ANOTHER_OPERATOR
    """Who says it."""

    def __post_init__(self) -> None:
        _check_sender(self, self.by)


@dataclass(frozen=True, slots=True)
class Cleared:
    """The stop is cleared."""


@dataclass(frozen=True, slots=True)
class LosesLease:
    """The lease of this operator ends. Until then every sender of a script holds the one it needs."""

    sender: Sender = OPERATOR
    """Who has it no more."""

    def __post_init__(self) -> None:
        _check_sender(self, self.sender)


@dataclass(frozen=True, slots=True)
class SlowedTo:
    """The link leaves this share of the speed from now on, 0 to 1."""

    factor: float
    """0: nothing may move, 1: as fast as it was commanded."""

    def __post_init__(self) -> None:
        if not 0 <= _number(self, self.factor) <= 1:
            raise ValueError(f"SlowedTo takes a share from 0 to 1, not {self.factor}")


FeedStep: TypeAlias = (
    "Silence | Leaves | From | Stopped | Cleared | LosesLease | SlowedTo | BaseModel | dict[str, Any] | list[Any] | str"
    " | bytes"
)


@dataclass(frozen=True, slots=True)
class MadeSafe:
    """A safe action that the receiver ran."""

    at_s: float
    """Seconds since the script began."""
    cause: str
    """Why: a code ``safety.…``."""


@dataclass(frozen=True, slots=True)
class RefusedMessage:
    """A message that was refused: before ``handle_data`` or by it."""

    at_s: float
    """Seconds since the script began, or the question was asked."""
    code: str
    """The reason, as the operator gets it."""
    message: str
    """The same in words."""


@dataclass(slots=True)
class Fed:
    """The outcome of a script of steps."""

    accepted: list[Any] = field(default_factory=list)
    """The messages that ``handle_data`` took, as it got them."""
    refused: list[RefusedMessage] = field(default_factory=list)
    """What was refused, and why."""
    made_safe: list[MadeSafe] = field(default_factory=list)
    """The safe actions that ran."""
    idle: int = 0
    """Zeros that were accepted and not handed over: the robot stood for a second already."""
