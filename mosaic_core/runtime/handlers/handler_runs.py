"""Everything that runs the handlers of one robot: their hosts, bodies, receivers and safe actions. Handlers exist
once, whatever the number of operators, and know nothing of peers coming and going.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Mapping, Sequence
from typing import Protocol, get_args

from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelReceivable,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.contract.host import Loss, Sender
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.handlers.body import runner_of
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.receiver import Outcome, Receiver
from mosaic_core.runtime.handlers.request_desk import RequestDesk
from mosaic_core.runtime.handlers.routes import Route, data_routes, handlers_of, original_groups
from mosaic_core.runtime.handlers.runner import Runner
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.media.talk_hub import TalkHub
from mosaic_core.runtime.observation.counters import ConnectorCounters, ConnectorSnapshot, HandlerLosses
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.threads.stacks import PluginCode
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory

logger = logging.getLogger(__name__)

_SAFE_PATIENCE_S = 0.4
"""For the safe actions at the end; they are meant to be quick."""
_WORST_FIRST = ("failed", "running", "waiting", "ended", "stopped")


class RunsListener(Protocol):
    """Hears what becomes of the robot's handlers; on the event loop."""

    def command_done(self, outcome: Outcome) -> None: ...
    def connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None: ...
    def talking_changed(self, label: str, who: Sender | None) -> None: ...


class HandlerRuns:
    """Runs all handlers of a robot, and counts what they send and receive. Made on the event loop when the robot
    starts."""

    def __init__(
        self,
        connectors: Sequence[Connector],
        open_stream: PictureStreamFactory,
        listener: RunsListener,
        links: LinkWatch,
        open_sound: SoundStreamFactory = plain_sound,
    ) -> None:
        loop = asyncio.get_running_loop()
        self._connectors = tuple(connectors)
        self._listener = listener
        self._links = links
        self.counters = {connector.config.label: ConnectorCounters() for connector in connectors}
        self.routes = data_routes(connectors, self.counters)
        self.outbox = Outbox(loop, self._watched)
        self.media = MediaHub(open_stream, self._watched, open_sound)
        self.talk = TalkHub(listener.talking_changed)
        self.safety = SafetyWatchdog()
        self._loop = loop
        self._outcomes: Handover[Outcome] = Handover(loop, self._command_done)
        self._failed: Handover[tuple[str, BaseException, float]] = Handover(loop, self._tell_failed)
        self._runners: dict[str, Runner] = {}
        self._failures: dict[str, Failures] = {}
        self._losses: dict[str, HandlerLosses] = {}
        self._always: set[str] = set()
        self._groups = original_groups(connectors)
        for route in self.routes.values():
            self._take(route.handler)
            if isinstance(route.handler, DataChannelReceivable):
                route.receiver = self._receiver(route, route.handler)
            audience = route.receiver.requests if route.receiver is not None else None
            self.outbox.add_channel(route.label, route.connector.terms, route.counters, audience)
        for connector, handler in handlers_of(connectors, MediaTrackHandler):
            counters = self.counters[connector.config.label]
            self.media.add_label(handler.label, handler.encoding, counters, handler.packet_codec)
            self._take(handler)
        self._take_sound()

    def _take_sound(self) -> None:
        for connector, microphone in handlers_of(self._connectors, AudioTrackHandler):
            counters = self.counters[connector.config.label]
            self.media.add_microphone(microphone.label, microphone.encoding, counters)
            self._take(microphone)
        for connector, speaker in handlers_of(self._connectors, AudioReceivable):
            self._take(speaker)
            self.talk.add_label(speaker, self._failures[speaker.label], self.counters[connector.config.label])

    def _take(self, handler: Handler) -> None:
        """Bind the handler and prepare its body."""
        host = RuntimeHost(self._loop, self.outbox, self.media)
        handler.bind(host)
        self._losses[handler.label] = host.losses
        code = PluginCode((handler,))
        failures = Failures(handler.label, lambda *failure: self._failed.put(failure), code=code)
        self._failures[handler.label] = failures
        runner = runner_of(handler, host, failures)
        if runner is not None:
            self._runners[handler.label] = runner
        if handler.runs == "always":
            self._always.add(handler.label)

    def _receiver(self, route: Route, handler: DataChannelReceivable[object]) -> Receiver:
        failures, requests, make_safe = self._failures[route.label], None, handler.make_safe
        if isinstance(handler, RequestHandler):
            requests = RequestDesk(handler, failures, is_motion=route.safety.is_motion)
            make_safe = requests.make_safe
        watch = self.safety.guard(route.label, route.safety, make_safe, handler.peer_left)
        return Receiver(
            handler,
            watch,
            failures,
            self._outcomes.put,
            newest_only=route.is_latest,
            limits=route.connector.terms.limits,
            max_age_s=route.max_age_s,
            measures_of=self._links.measures_of,
            requests=requests,
        )

    # -- life ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        self.safety.start()
        self.talk.start()
        for receiver in self._receivers():
            receiver.start()
        for label, runner in self._runners.items():
            runner.start()
            runner.want(label in self._always)

    async def close(self) -> None:
        """Commands first, then what moves, then the rest."""
        receivers = self._receivers()
        for receiver in receivers:
            receiver.close()
        self.talk.close()
        for runner in self._runners.values():
            runner.close()
        if receivers:
            safe = asyncio.to_thread(self.safety.make_all_safe, "safety.shutdown", _SAFE_PATIENCE_S)
            if not await safe:
                logger.error("a safe action did not end within %.1f s of the robot's stop", _SAFE_PATIENCE_S)
        endings = [receiver.closed() for receiver in receivers]
        endings += [runner.closed() for runner in self._runners.values()]
        await asyncio.gather(*endings, self.talk.closed())
        self.media.close()
        self.safety.close()

    def _receivers(self) -> list[Receiver]:
        return [route.receiver for route in self.routes.values() if route.receiver is not None]

    def _watched(self, label: str, on: bool) -> None:
        group = self._groups.get(label, (label,))
        runner = self._runners.get(group[0])
        others = [other for other in group if other != label and self.outbox.is_heard(other)]
        if runner is not None and group[0] not in self._always and not others:
            runner.want(on)

    # -- what happened -------------------------------------------------------------------------------------------

    def _command_done(self, outcome: Outcome) -> None:
        route = self.routes[outcome.item.channel]
        counters = route.counters
        if outcome.refusal is not None:
            counters.refuse(outcome.refusal.gate)
            if route.receiver is not None and route.receiver.requests is not None:
                route.receiver.requests.refused(outcome.item, outcome.refusal)
        else:
            counters.count(len(outcome.item.payload), time.monotonic())
        self._listener.command_done(outcome)

    def _tell_failed(self, failure: tuple[str, BaseException, float]) -> None:
        self._listener.connector_failed(*failure)

    def snapshot(self, limit_factors: Mapping[str, float]) -> tuple[ConnectorSnapshot, ...]:
        """One row per connector, in the order of the YAML file. ``limit_factors``: what is left of the speed, by label
        of the receiver."""
        return tuple(self._row(connector, limit_factors) for connector in self._connectors)

    def _row(self, connector: Connector, limit_factors: Mapping[str, float]) -> ConnectorSnapshot:
        now_s, counters = time.monotonic(), self.counters[connector.config.label]
        rate_hz, bytes_per_s = counters.meter.rates(now_s)
        labels = [handler.label for handler in connector.handlers]
        failing = [self._failures[label] for label in labels]
        states = [self._state(label) for label in labels]
        worst = next((one for one, state in zip(failing, states, strict=True) if state == "failed"), None)
        queue_messages, queue_bytes = max(map(self._waiting, labels))
        lost = {reason: getattr(counters, reason) + self._left_out(labels, reason) for reason in get_args(Loss)}
        lost["replaced"] += self._replaced_in(labels)
        return ConnectorSnapshot(
            label=connector.config.label,
            type=connector.config.type,
            kind=str(connector.entry.kind),
            direction=str(connector.entry.direction),
            delivery=str(connector.delivery),
            state=next((state for state in _WORST_FIRST if state in states), "running"),
            peers=max((self.outbox.listeners(label) or self.media.viewers(label) for label in labels), default=0),
            messages=counters.messages,
            rate_hz=rate_hz,
            size_bytes=counters.size_bytes,
            bytes_per_s=bytes_per_s,
            queue_messages=queue_messages,
            queue_bytes=queue_bytes,
            **lost,
            refused_by=dict(counters.refused_by),
            resent=counters.resent,
            failures=sum(failures.count for failures in failing),
            last_error=next((failures.last_error for failures in failing if failures.last_error), ""),
            failure_code=worst.last_code if worst is not None else "",
            tries_again_in_s=worst.tries_again_in_s if worst is not None else None,
            age_s=None if counters.last_at_s is None else now_s - counters.last_at_s,
            limit_factor=min((limit_factors[label] for label in labels if label in limit_factors), default=None),
        )

    def _waiting(self, label: str) -> tuple[int, int]:
        route = self.routes.get(label)
        inbox = route.receiver.inbox.waiting() if route is not None and route.receiver is not None else (0, 0)
        return max(inbox, self.outbox.waiting(label))

    def _replaced_in(self, labels: Sequence[str]) -> int:
        """Commands that a newer one replaced before the receiver took them."""
        receivers = (self.routes[label].receiver for label in labels if label in self.routes)
        return sum(receiver.inbox.replaced for receiver in receivers if receiver is not None)

    def _left_out(self, labels: Sequence[str], reason: Loss) -> int:
        """What the handlers themselves did not send on."""
        return sum(self._losses[label][reason] for label in labels)

    def _state(self, label: str) -> str:
        runner, route = self._runners.get(label), self.routes.get(label)
        # what only receives has nothing to restart: after its rest it takes the next message
        rested = runner is None and route is not None and route.receiver is not None and not route.receiver.is_resting
        if self._failures[label].is_failing and not rested:
            return "failed"
        return runner.state if runner is not None else "running"
