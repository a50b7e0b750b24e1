"""The set-up of one operator's connection as the robot sees it: told in one line of the log when it failed.

It also notices cameras that are watched and give nothing: the operator learns that from its own end, whoever looks
after the robot from here.
"""

from __future__ import annotations

import asyncio
import logging
import time

from mosaic_core.machines.media.first_frame import FIRST_FRAME_TIMEOUT_S
from mosaic_core.machines.peers.chosen_path import ChosenPath
from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.words.codes import reason
from mosaic_core.words.timeline import Moment

logger = logging.getLogger(__name__)


class PeerTimeline:
    """Marks how far one connection got, and logs what a person should know of it. Event loop only."""

    def __init__(self, operator: RemoteOperator) -> None:
        self.record = ConnectionTimeline(time.monotonic())
        self._operator = operator
        self._awaited: dict[str, asyncio.TimerHandle] = {}
        self._sent: set[str] = set()
        self.mark("offered")

    def mark(self, moment: Moment, detail: str = "") -> None:
        self.record.mark(moment, time.monotonic(), detail)

    def transport_changed(self, state: str, path: ChosenPath | None) -> None:
        """``securing`` means that ICE has a path; it may be left out before ``connected``."""
        if state in ("securing", "connected"):
            self.mark("ice", "" if path is None else path.summary())
        if state == "connected":
            self.mark("dtls")

    def watched(self, label: str, on: bool) -> None:
        """The operator looks at a camera, or does not any more."""
        timer = self._awaited.pop(label, None)
        if timer is not None:
            timer.cancel()
        if on and label not in self._sent and self.record.ended_ms is None:
            loop = asyncio.get_running_loop()
            self._awaited[label] = loop.call_later(FIRST_FRAME_TIMEOUT_S, self._complain, label)

    def frame_sent(self, label: str) -> None:
        """The first picture of a camera has left."""
        self._sent.add(label)
        self.watched(label, False)
        self.mark("frame", label)

    def ended(self, code: str, *, was_connected: bool) -> None:
        """The connection is over; one that never came up is worth a line with how far it got."""
        for label in list(self._awaited):
            self.watched(label, False)
        self.record.end(code, time.monotonic())
        if not was_connected:
            fields = {"peerId": self._operator.peer_id, "code": code, "timeline": self.record.summary()}
            text = "no connection with operator %s (%s) %s; phases: %s"
            sentence = self._sentence(code)
            logger.warning(text, self._operator.name, code, sentence, self.record.summary(), extra=fields)

    def _complain(self, label: str) -> None:
        del self._awaited[label]
        fields = {"peerId": self._operator.peer_id, "label": label, "code": "media.not_sent"}
        text = "camera %s is watched by operator %s, but no picture has left within %.0f s (media.not_sent)"
        logger.warning(text, label, self._operator.name, FIRST_FRAME_TIMEOUT_S, extra=fields)

    @staticmethod
    def _sentence(code: str) -> str:
        try:
            return reason(code).sentence
        except KeyError:
            return ""
