"""Records what a receiver was told to do and when: the drill's eyes. In a dry drill it stands in for the plugin's own
code."""

from __future__ import annotations

import functools
import inspect
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import BaseModel

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.drill.commands import DrillCommand
from mosaic_core.runtime.threads.stacks import PluginCode


@dataclass(frozen=True, slots=True)
class Act:
    """What a drilled receiver did, and when. ``command``: ``handle_data`` had carried out ``value``; ``safe``: the safe
    action had returned, for ``cause``; ``failed``: one of the two raised, with the line as its ``cause``.
    """

    at_s: float
    kind: Literal["command", "safe", "failed"]
    value: Any = None
    cause: str = ""


class ActRecorder:
    """The acts of one receiver, in their order. Any thread. ``place_of``: the line of an error."""

    def __init__(self, place_of: Callable[[BaseException], str] = lambda error: "") -> None:
        self._place_of = place_of
        self._acts: list[Act] = []
        self.is_acting = False
        """Whether ``handle_data`` runs just now."""
        self.began_at_s = 0.0
        """When it began last."""
        self._lock = threading.Lock()

    @property
    def acts(self) -> tuple[Act, ...]:
        with self._lock:
            return tuple(self._acts)

    @contextmanager
    def acting(self, kind: Literal["command", "safe"]) -> Iterator[None]:
        """While the block runs it does what its plugin wrote; what that raises is one of the acts."""
        if kind == "command":
            self.is_acting, self.began_at_s = True, time.monotonic()
        try:
            yield
        except BaseException as error:
            place = "" if isinstance(error, Refused) else self._place_of(error)
            self.add("failed", cause=f"{type(error).__name__}: {error}" + (f" ({place})" if place else ""))
            raise
        finally:
            self.is_acting = self.is_acting and kind != "command"

    def add(self, kind: Literal["command", "safe", "failed"], value: Any = None, cause: str = "") -> None:
        plain = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
        with self._lock:
            self._acts.append(Act(time.monotonic(), kind, plain, cause))

    def commands_since(self, at_s: float) -> list[Act]:
        return [act for act in self.acts if act.kind == "command" and act.at_s >= at_s]

    def is_calm(self, for_s: float) -> bool:
        """Whether no command is carried out, nor has begun to be for so long."""
        return not self.is_acting and time.monotonic() - self.began_at_s >= for_s

    def commands_after_safe(self, cause: str = "") -> list[Act]:
        """The commands that came after the last safe action, whatever its cause or for this one. One that a safe action
        overtook returns after it, and the safe action is run once more then."""
        acts = self.acts
        safe = [at for at, act in enumerate(acts) if act.kind == "safe" and cause in ("", act.cause)]
        last = max(safe, default=-1)
        return [act for act in acts[last + 1 :] if act.kind == "command"]

    def safe_since(self, at_s: float, cause: str = "") -> Act | None:
        """The first safe action that returned at or after ``at_s``, whatever its cause or for this one."""
        safe = (act for act in self.acts if act.kind == "safe" and act.at_s >= at_s)
        return next((act for act in safe if cause in ("", act.cause)), None)

    @property
    def last_command(self) -> Act | None:
        return next((act for act in reversed(self.acts) if act.kind == "command"), None)


def watched(handler: DataChannelReceivable[Any], command: DrillCommand | None, *, live: bool) -> ActRecorder:
    """Record what ``handler`` does from now on; unless ``live``, nothing of the plugin's own code runs any more: its
    positions are then those of ``command``, and wherever it was sent since.

    Only this one object is changed, and it is the drill's own.
    """
    recorder = ActRecorder(PluginCode([handler]).place_of)
    handle, make_safe = (handler.handle_data, handler.make_safe) if live else (_nothing, _nothing)
    is_async = live and inspect.iscoroutinefunction(handler.handle_data)
    wrapped = _async_recorded(handle, recorder) if is_async else _recorded(handle, recorder, "command")
    object.__setattr__(handler, "handle_data", wrapped)
    object.__setattr__(handler, "make_safe", _recorded(make_safe, recorder, "safe"))
    if not live:
        object.__setattr__(handler, "peer_left", _ignore)
        object.__setattr__(handler, "keeper", None)  # what it shares is not entered: nobody starts that
        object.__setattr__(handler, "reported_position", _obedient(recorder, command))
    return recorder


def is_refusal(cause: str) -> bool:
    """Whether the ``cause`` of a failed act is that the receiver refused the command."""
    return cause.startswith("Refused:")


def _nothing(data: Any) -> None:
    """In place of ``handle_data`` and ``make_safe``."""


def _ignore(sender: Sender) -> None:
    """In place of ``peer_left``."""


def _obedient(recorder: ActRecorder, command: DrillCommand | None) -> Callable[[str], float]:
    """In place of ``reported_position``: it is where it was sent."""

    def reported_position(field: str) -> float:
        last = recorder.last_command
        return 0.0 if command is None else command.at(command.message if last is None else last.value, field)

    return reported_position


def _recorded(call: Callable[..., Any], recorder: ActRecorder, kind: Literal["command", "safe"]) -> Callable[..., Any]:
    @functools.wraps(call)
    def recording(*arguments: Any) -> Any:
        with recorder.acting(kind):
            result = call(*arguments)
        if kind == "safe":
            recorder.add("safe", cause=str(arguments[0]))
        else:
            recorder.add("command", arguments[0])
        return result

    return recording


def _async_recorded(call: Callable[..., Any], recorder: ActRecorder) -> Callable[..., Any]:
    @functools.wraps(call)
    async def recording(*arguments: Any) -> None:
        with recorder.acting("command"):
            await call(*arguments)
        recorder.add("command", arguments[0])

    return recording
