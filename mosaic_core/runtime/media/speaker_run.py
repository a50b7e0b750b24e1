"""Runs one ``handle_sound`` on a thread of its own, at the pace of the sound. An error is a failure of the handler,
which rests for the back-off; what is said meanwhile is lost.
"""

from __future__ import annotations

import threading
import time

from mosaic_core.contract.handler import AudioReceivable
from mosaic_core.contract.host import Sender
from mosaic_core.contract.sound import Sound
from mosaic_core.machines.media.playout import RATE_HZ, STEP, Play, Playout, PlaySilence, TalkOver
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import HandlerThread
from mosaic_core.runtime.transport.media_transport import HeardSound

STEP_S = STEP / RATE_HZ
MAX_BEHIND_S = 0.1
"""A device that fell further behind is not hurried: what piles up is skipped by the playout."""


class SpeakerRun:
    """Plays sound on one loudspeaker's thread. Methods on the event loop."""

    def __init__(self, handler: AudioReceivable, failures: Failures) -> None:
        self._handler = handler
        self._failures = failures
        self._playout: Playout[Sound] = Playout()
        self._sender: Sender | None = None
        self._changed = threading.Condition()
        self._must_end = False
        self._is_closing = False
        self._resting_until_s = 0.0
        self._thread = HandlerThread(handler.label, self._live)

    def start(self) -> None:
        self._thread.start()

    def put(self, heard: HeardSound, sender: Sender) -> bool:
        """The next piece of who has the floor; ``False`` if it can't be played."""
        with self._changed:
            if time.monotonic() < self._resting_until_s:
                return False
            self._sender = sender
            is_taken = self._playout.put(heard.position, len(heard.sound.samples), heard.sound)
            self._changed.notify_all()
            return is_taken

    @property
    def failure(self) -> tuple[str, str] | None:
        """Code and text while it rests after an error; ``None``: it plays."""
        with self._changed:
            is_resting = time.monotonic() < self._resting_until_s
        return (self._failures.last_code, "") if is_resting else None

    def silence(self) -> None:
        """Whoever talked has no floor any more: not one more sound of it."""
        with self._changed:
            self._must_end = self._must_end or not self._playout.is_idle
            self._playout.clear()
            self._changed.notify_all()

    def close(self) -> None:
        with self._changed:
            self._is_closing = True
            self._playout.clear()
            self._changed.notify_all()

    async def closed(self) -> None:
        """Wait until the thread has ended, or has been abandoned."""
        await self._thread.ended()

    # -- the thread ----------------------------------------------------------------------------------------------

    def _live(self) -> None:
        is_talking, due_s = False, 0.0
        step: Play[Sound] | PlaySilence | TalkOver | None
        while True:
            with self._changed:
                self._changed.wait_for(self._has_work)
                if self._must_end or self._is_closing:
                    self._must_end = False
                    step = TalkOver() if is_talking else None
                else:
                    step = self._playout.take()
                sender, is_closing = self._sender, self._is_closing
            if isinstance(step, Play | PlaySilence) and sender is not None:
                due_s = due_s if is_talking else time.monotonic()
                is_talking = self._carry_out(step, sender)
            elif isinstance(step, TalkOver) and is_talking:
                is_talking = self._end()
            if is_closing:
                return
            due_s = self._pace(step, due_s)

    def _has_work(self) -> bool:
        return self._is_closing or self._must_end or not self._playout.is_idle

    def _pace(self, step: Play[Sound] | PlaySilence | TalkOver | None, due_s: float) -> float:
        """Wait until the step is over by the clock; a device that takes the sound at its own pace has waited by now."""
        now_s = time.monotonic()
        length_s = step.length / RATE_HZ if isinstance(step, Play | PlaySilence) else STEP_S
        base_s = due_s if isinstance(step, Play | PlaySilence) else now_s
        due_s = max(base_s + length_s, now_s - MAX_BEHIND_S)
        with self._changed:
            self._changed.wait_for(lambda: self._must_end or self._is_closing, max(0.0, due_s - now_s))
        return due_s

    def _carry_out(self, step: Play[Sound] | PlaySilence, sender: Sender) -> bool:
        """Whether the handler goes on."""
        sound = step.item if isinstance(step, Play) else _silence(step.length)
        try:
            self._handler.handle_sound(sound, sender)
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything)
            now_s = time.monotonic()
            rest_s = self._failures.failed(error, now_s - self._resting_until_s)
            with self._changed:
                self._resting_until_s = now_s + rest_s
                self._playout.clear()
            self._end()
            return False
        self._failures.alive()
        return True

    def _end(self) -> bool:
        try:
            self._handler.talk_ended()
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything)
            self._failures.failed(error, 0.0)
        return False


def _silence(length: int) -> Sound:
    import numpy as np

    return Sound(np.zeros((length, 2), np.int16), RATE_HZ, time.monotonic())
