"""Runs one connector as a robot would, but for the robot: its bodies, receivers and safe actions, and somebody who
watches, listens and asks."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from mosaic_core.contract.handler import AudioTrackHandler, MediaTrackHandler
from mosaic_core.contract.host import Outgoing, Sender
from mosaic_core.drill.rig import comes_true
from mosaic_core.laboratory.memory_network import MemoryNetwork
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.commands.inbox import Incoming
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.handlers.body import body_of
from mosaic_core.runtime.handlers.handler_runs import HandlerRuns
from mosaic_core.runtime.handlers.receiver import Outcome

VIEWER = "ladder"


@dataclass(slots=True)
class TrialRun:
    """What became of one run. ``tried``: the connector that it is about; ``failures``: the errors that ended bodies;
    ``ended``: the channels of questions that were answered or refused; ``stop_s``: how long the end took, once it is
    over."""

    runs: HandlerRuns
    tried: Connector
    failures: list[BaseException]
    ended: set[str]
    stop_s: float = 0.0

    async def begun(self, patience_s: float) -> None:
        """Wait until it has sent something or failed, at most so long; what has no body sends nothing by itself."""
        if any(body_of(handler) is not None for handler in self.tried.handlers):
            await comes_true(lambda: self._has_sent() or self.failures, patience_s)

    async def ask(self, label: str, question: bytes, patience_s: float) -> None:
        """Ask a request handler, and wait for what it says, at most so long."""
        receiver, sender = self.runs.routes[label].receiver, Sender(VIEWER, VIEWER)
        assert receiver is not None
        opening = receiver.channel_opened(sender)
        receiver.accept(Incoming(label, question, sender, None, time.monotonic(), opening=opening))
        await comes_true(lambda: label in self.ended, patience_s)

    def _has_sent(self) -> bool:
        rows = self.runs.snapshot({})[: len(self.tried.groups)]  # in the order of the connectors
        return any(row.messages for row in rows)


class _Ear:
    """Listens to everything and keeps nothing but what ended; also hears what becomes of the handlers."""

    def __init__(self) -> None:
        self.failures: list[BaseException] = []
        self.ended: set[str] = set()

    def deliver(self, message: Outgoing) -> Offered:
        if message.to == VIEWER and message.kind is PayloadKind.JSON and "progress" not in json.loads(message.payload):
            self.ended.add(message.channel)
        return Offered.QUEUED

    def waiting(self, channel: str) -> tuple[int, int]:
        return 0, 0

    def command_done(self, outcome: Outcome) -> None:
        """Nobody asked."""

    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        self.failures.append(error)

    def talking_changed(self, label: str, who: Sender | None) -> None:
        """Nobody talks."""


@asynccontextmanager
async def trial_run(configured: Configured) -> AsyncIterator[TrialRun]:
    """Run the handlers of ``configured``, whose shared things are entered, with everything watched, until the block
    ends. It is about the first connector; the others stand beside it."""
    network, ear = MemoryNetwork(), _Ear()
    runs = HandlerRuns(configured.connectors, network.open_stream, ear, LinkWatch(), network.open_sound)
    run = TrialRun(runs, configured.connectors[0], ear.failures, ear.ended)
    runs.start()
    _watch_all(configured, runs, ear)
    try:
        yield run
    finally:
        began_s = time.monotonic()
        await runs.close()
        run.stop_s = time.monotonic() - began_s


def _watch_all(configured: Configured, runs: HandlerRuns, ear: _Ear) -> None:
    for connector in configured.connectors:
        for handler in connector.handlers:
            if isinstance(handler, MediaTrackHandler | AudioTrackHandler):
                runs.media.bind(VIEWER, handler.label, lambda code: None)
                runs.media.watch(VIEWER, handler.label, on=True)
            else:
                runs.outbox.join(handler.label, VIEWER, ear)


@asynccontextmanager
async def entered(configured: Configured) -> AsyncIterator[None]:
    """Enter what the connectors share, as a robot does when it starts."""
    stack = await asyncio.to_thread(configured.shared.entered)
    try:
        yield
    finally:
        await asyncio.to_thread(stack.close)
