"""Names the gates that a command passes, and what one says that refuses; their order is ``admission.py``'s."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

from mosaic_core.words.codes import REASONS
from mosaic_core.words.errors import Refused


class Gate(StrEnum):
    """Something that a command must pass; the word in refusals, logs, journal and metrics."""

    MESSAGE = "message"
    ROLE = "role"
    ORIGIN = "origin"
    LEASE = "lease"
    AGE = "age"
    SEQUENCE = "sequence"
    RATE = "rate"
    STOP = "stop"
    QUEUE = "queue"
    REST = "rest"
    LINK = "link"
    PICTURE = "picture"
    SHAPE = "shape"
    ENVELOPE = "envelope"
    ACT = "act"
    HANDLER = "handler"


@dataclass(frozen=True, slots=True)
class GateRefusal:
    """Why a command does not act. ``message``: what is wrong with just this one, if there is more to say than the
    code's sentence."""

    gate: Gate
    code: str
    message: str = ""

    @property
    def cause(self) -> str:
        """The sentence for people."""
        return self.message or (REASONS[self.code].sentence if self.code in REASONS else self.code)

    @property
    def cure(self) -> str:
        return REASONS[self.code].cure if self.code in REASONS else ""


class WrongShape(Refused):
    """A message was refused once it was within its limits, but fitted no better before: the gate ``shape`` says so."""


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class GateRule(Generic[T]):
    """A gate in its place. ``asks``: the code why not; ``None``: whoever is named in ``where`` asks by itself.
    ``codes``: with which it refuses; none: it only slows down."""

    gate: Gate
    question: str
    codes: tuple[str, ...]
    asks: Callable[[T], str | None] | None = None
    where: str = ""
