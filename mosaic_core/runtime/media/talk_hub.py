"""The operators' voices on their way to the loudspeakers: one talker at a time, who is told to everybody."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Protocol

from mosaic_core.contract.handler import AudioReceivable
from mosaic_core.contract.host import Sender
from mosaic_core.machines.media.talk_floor import TalkFloor
from mosaic_core.runtime.media.speaker_run import SpeakerRun
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.media_transport import HeardSound, IncomingSound


class Talker(Protocol):
    """A peer, as far as its voice goes."""

    @property
    def peer_id(self) -> str: ...
    @property
    def sender(self) -> Sender:
        """Who it is by now: its role is known before it talks, its name may come later."""

    def refuse(self, label: str, seq: int | None, code: str, message: str = "") -> None: ...


TellTalking = Callable[[str, Sender | None], None]
"""``(label, who)`` whenever somebody begins to talk or, with ``None``, nobody does any more."""


class TalkHub:
    """Brings operators' voices to the loudspeakers of one robot. Event loop only."""

    def __init__(self, tell: TellTalking) -> None:
        self._tell = tell
        self._speakers: dict[str, _Speaker] = {}
        self._lines: dict[str, list[tuple[str, IncomingSound, asyncio.Task[None]]]] = {}

    def add_label(self, handler: AudioReceivable, failures: Failures, counters: ConnectorCounters) -> None:
        self._speakers[handler.label] = _Speaker(handler, failures, counters, self._tell)

    async def remove_label(self, label: str) -> None:
        """The loudspeaker is gone; whoever talks to it is not heard any more."""
        speaker = self._speakers.pop(label, None)
        if speaker is not None:
            speaker.close()
            await speaker.run.closed()

    def start_label(self, label: str) -> None:
        """Its thread waits for sound from now on."""
        self._speakers[label].run.start()

    def labels(self) -> tuple[str, ...]:
        """In the order of the YAML file."""
        return tuple(self._speakers)

    def talking(self) -> dict[str, Sender]:
        """Who talks now, by label."""
        return {label: one.talker for label, one in self._speakers.items() if one.talker is not None}

    def bind(self, talker: Talker, label: str, sound: IncomingSound) -> None:
        """The peer has a line for its voice to ``label``."""
        task = asyncio.get_running_loop().create_task(self._listen(talker, label, sound), name=f"mosaic-talk-{label}")
        self._lines.setdefault(talker.peer_id, []).append((label, sound, task))

    def leave(self, peer_id: str) -> None:
        """The peer is gone: silent at once, in the middle of a word."""
        for label, sound, task in self._lines.pop(peer_id, []):
            task.cancel()
            sound.stop()
            if label in self._speakers:
                self._speakers[label].left(peer_id)

    def close(self) -> None:
        for peer_id in tuple(self._lines):
            self.leave(peer_id)
        for speaker in self._speakers.values():
            speaker.close()

    async def closed(self) -> None:
        await asyncio.gather(*(speaker.run.closed() for speaker in self._speakers.values()))

    async def _listen(self, talker: Talker, label: str, sound: IncomingSound) -> None:
        while (heard := await sound.next()) is not None:
            if label in self._speakers:  # perhaps another one than before
                self._speakers[label].heard(talker, heard)
        if label in self._speakers:
            self._speakers[label].left(talker.peer_id)


class _Speaker:
    """A loudspeaker and who has its floor."""

    def __init__(
        self, handler: AudioReceivable, failures: Failures, counters: ConnectorCounters, tell: TellTalking
    ) -> None:
        self.run = SpeakerRun(handler, failures)
        self.talker: Sender | None = None
        self._label = handler.label
        self._counters = counters
        self._tell = tell
        self._floor = TalkFloor()
        self._timer = DeadlineTimer(self._look)
        self._is_failure_told = False

    def heard(self, talker: Talker, heard: HeardSound) -> None:
        holds = self.talker is not None and self.talker.peer_id == talker.peer_id
        if heard.is_silent:  # an open microphone in a quiet room neither asks for the floor nor keeps it
            if holds:
                self._play(talker, heard)
            return
        now_s = time.monotonic()
        code = refusal_of(talker.sender)
        verdict = self._floor.heard(talker.peer_id, now_s, may_talk=code is None)
        if verdict == "heard":
            if not holds:
                self._changed(talker.sender)
            self._play(talker, heard)
        elif verdict == "refused":
            self._counters.refused += 1
            name = self.talker.name if self.talker is not None and code is None else ""
            talker.refuse(self._label, None, code or "media.talk_busy", f"{name} is talking." if name else "")

    def _play(self, talker: Talker, heard: HeardSound) -> None:
        if self.run.put(heard, talker.sender):
            self._counters.count(heard.sound.samples.nbytes, time.monotonic())
            return
        self._counters.dropped += 1
        failure = self.run.failure
        if failure is not None and not self._is_failure_told:
            self._is_failure_told = True
            talker.refuse(self._label, None, *failure)

    def left(self, peer_id: str) -> None:
        if self._floor.left(peer_id):
            self._changed(None)

    def close(self) -> None:
        self._timer.cancel()
        self.run.close()

    def _changed(self, talker: Sender | None) -> None:
        self.talker = talker
        self._is_failure_told = False
        self.run.silence()
        self._tell(self._label, talker)
        self._timer.cancel()
        if talker is not None:
            self._look()

    def _look(self) -> None:
        """Ask again when the floor may be free."""
        now_s = time.monotonic()
        if self._floor.holder(now_s) is None:
            self._changed(None)
        else:
            self._timer.set(max(now_s, self._floor.silent_at_s()) + 0.01)


def refusal_of(sender: Sender) -> str | None:
    """Why somebody's voice is not taken; ``None``: it is."""
    return None if sender.role in ("operator", "supervisor") else "lease.forbidden"
