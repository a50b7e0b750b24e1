"""The guard of a robot's event loop: a thread that notices when the loop doesn't come round, and names the connector
and the line that block it.

``time.sleep`` in an ``async def`` costs every operator the connection, and nothing in the log would say whose it was.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.loop_watch import (
    LOOK_PERIOD_S,
    AskLoop,
    Blame,
    LookAtStack,
    LoopWatch,
    TellBlocked,
    blamed,
)
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.runtime.threads.stacks import PluginCode
from mosaic_core.words.codes import reason

logger = logging.getLogger(__name__)

CODE = "plugin.blocks_loop"
TOLD_AGAIN_S = 60.0
"""The same line is told in the log once, and again while it goes on."""


@dataclass(frozen=True, slots=True)
class LoopBlock:
    """One time that the event loop was blocked. ``at_s``: when it was over, on the monotonic clock."""

    blame: Blame | None
    duration_s: float
    at_s: float

    @property
    def label(self) -> str:
        return "" if self.blame is None else self.blame.label

    @property
    def place(self) -> str:
        return "many small things" if self.blame is None else str(self.blame)


class LoopGuard:
    """Watches the loop that makes it, from :meth:`start` to :meth:`stop`. ``told`` hears of each block on the loop when
    it is over; the log does while it lasts, where it lasts long."""

    def __init__(self, handlers: Iterable[Handler], told: Callable[[LoopBlock], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop_thread = threading.get_ident()
        self._told = told
        self._plugins = PluginCode(handlers)
        self._complaints = ComplaintPace(TOLD_AGAIN_S)
        self._stopped = threading.Event()
        self._has_answered = False
        self._blame: Blame | None = None
        self._thread = threading.Thread(target=self._watch, name="mosaic-loop-guard", daemon=True)

    def watch(self, handlers: Iterable[Handler]) -> None:
        """These are the robot's handlers from now on."""
        self._plugins = PluginCode(handlers)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopped.set()

    # -- the guard's own thread ----------------------------------------------------------------------------------

    def _watch(self) -> None:
        machine = LoopWatch(time.monotonic())
        while not self._stopped.wait(LOOK_PERIOD_S):
            now_s = time.monotonic()
            for effect in machine.look(now_s, has_answered=self._has_answered):
                try:
                    self._carry_out(effect, now_s)
                except RuntimeError:
                    return  # the loop is closed: the robot has ended

    def _carry_out(self, effect: object, now_s: float) -> None:
        match effect:
            case AskLoop():
                self._has_answered = False
                self._loop.call_soon_threadsafe(self._answer)
            case LookAtStack():
                self._blame = blamed(self._plugins.stack_of(self._loop_thread))
            case TellBlocked(duration_s, is_over):
                self._log(duration_s, is_over, now_s)
                if is_over:
                    self._loop.call_soon_threadsafe(self._told, LoopBlock(self._blame, duration_s, now_s))

    def _answer(self) -> None:
        self._has_answered = True

    def _log(self, duration_s: float, is_over: bool, now_s: float) -> None:
        block = LoopBlock(self._blame, duration_s, now_s)
        is_due = self._complaints.is_due((block.label, block.place, is_over), now_s)
        text = "the event loop was blocked for %.2f s" if is_over else "the event loop is blocked, for %.1f s so far"
        if not block.label:
            logger.log(logging.INFO if is_due else logging.DEBUG, f"{text}: %s", duration_s, block.place)
            return
        fields = {"label": block.label, "code": CODE, "place": block.place}
        text += f", by connector %r: %s ({CODE}). {reason(CODE).cure}"
        level = logging.WARNING if is_due else logging.DEBUG
        logger.log(level, text, duration_s, block.label, block.place, extra=fields)
