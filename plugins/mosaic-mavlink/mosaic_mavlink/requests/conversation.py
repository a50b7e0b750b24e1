"""The base of conversations with a vehicle, and what they ask the driver to do. Pure: messages and time go in, effects
come out.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from mosaic_mavlink.link.outgoing import OutgoingMessage


@dataclass(frozen=True, slots=True)
class SendMessage:
    """Send this to the vehicle."""

    message: OutgoingMessage


@dataclass(frozen=True, slots=True)
class ShowProgress:
    """Tell whoever asked how far it is."""

    done: int
    total: int | None = None
    said: str = ""


@dataclass(frozen=True, slots=True)
class Concluded:
    """A conversation with the vehicle is over, with this result."""

    result: Any


@dataclass(frozen=True, slots=True)
class NotConcluded:
    """A conversation with the vehicle is over: it refused or fell silent. ``code`` and ``message`` are for the
    operator.
    """

    code: str
    message: str


Effect: TypeAlias = SendMessage | ShowProgress | Concluded | NotConcluded


class Conversation(ABC):
    """One question to a vehicle. What was said last is said again after :attr:`patience_s`, :attr:`attempts` times."""

    listens: ClassVar[frozenset[str]]
    patience_s: ClassVar[float] = 1.0
    attempts: ClassVar[int] = 5
    what: str = "the question"

    def __init__(self) -> None:
        self.deadline_s = float("inf")
        """When :meth:`time_passed` wants to be called."""
        self._said: tuple[OutgoingMessage, ...] = ()
        self._count = 0

    @abstractmethod
    def begin(self, now_s: float) -> list[Effect]:
        """The first words."""

    @abstractmethod
    def hear(self, message: Any, now_s: float) -> list[Effect]:
        """A message of one of the kinds that it listens for; nothing where it says nothing."""

    def cancel(self) -> list[Effect]:
        """Whoever asked takes the question back."""
        return []

    def say(self, now_s: float, *messages: OutgoingMessage) -> list[Effect]:
        """Say something new, and wait for an answer to it."""
        self._said, self._count = messages, 1
        self.deadline_s = now_s + self.patience_s
        return [SendMessage(one) for one in messages]

    def time_passed(self, now_s: float) -> list[Effect]:
        """Say it again, or give up."""
        if now_s < self.deadline_s:
            return []
        if self._count >= self.attempts:
            message = f"the vehicle did not answer {self.what}, asked {self._count} times; look at the link"
            return [NotConcluded("mavlink.no_answer", message)]
        self._count += 1
        self.deadline_s = now_s + self.patience_s
        return [SendMessage(one) for one in self.repeated(self._count)]

    def repeated(self, count: int) -> tuple[OutgoingMessage, ...]:
        """What is said the ``count``-th time."""
        return self._said
