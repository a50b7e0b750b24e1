"""Everything that runs the handlers of one robot: their hosts, bodies, receivers and safe actions. Handlers exist
once, whatever the number of operators, and know nothing of peers coming and going.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.contract.devices.keeper import AbsenceListener, Keeper
from mosaic_core.contract.handler import (
    AudioReceivable,
    AudioTrackHandler,
    DataChannelReceivable,
    Handler,
    MediaTrackHandler,
)
from mosaic_core.contract.host import Sender
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.commands.safety_watch import SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.handlers.body import runner_of
from mosaic_core.runtime.handlers.connector_rows import ConnectorRows
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.receiver import Outcome, Receiver
from mosaic_core.runtime.handlers.request_desk import RequestDesk
from mosaic_core.runtime.handlers.routes import Route, data_routes, handlers_of, original_groups, tapped_channels
from mosaic_core.runtime.handlers.runner import Runner
from mosaic_core.runtime.handlers.still_cameras import StillCameras
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.plain_stream import plain_sound
from mosaic_core.runtime.media.talk_hub import TalkHub
from mosaic_core.runtime.observation.counters import ConnectorCounters, ConnectorSnapshot, HandlerLosses
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.threads.stacks import PluginCode
from mosaic_core.runtime.transport.media_transport import PictureStreamFactory, SoundStreamFactory
from mosaic_core.words.errors import DeviceGone

logger = logging.getLogger(__name__)

_SAFE_PATIENCE_S = 0.4
"""For the safe actions at the end; they are meant to be quick."""


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
        self._connectors: tuple[Connector, ...] = ()
        self._listener = listener
        self._links = links
        self.counters: dict[str, ConnectorCounters] = {}
        """By the label of a handler; handlers that operators see as one count together."""
        self.routes: dict[str, Route] = {}
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
        self._listeners: dict[str, list[tuple[Keeper, AbsenceListener]]] = {}
        self._always: set[str] = set()
        self._groups: dict[str, tuple[str, ...]] = {}
        self._rows = ConnectorRows(
            self.routes, self.counters, self.outbox, self.media, self._runners, self._failures, self._losses
        )
        self._still = StillCameras(self.media, self._runners, self.counters)
        for connector in connectors:
            self._add(connector)
        self._ordered(connectors)

    def _add(self, connector: Connector) -> None:
        """Make ways for everything that a new connector sends and takes."""
        for group in connector.groups:
            counters = ConnectorCounters()
            self.counters.update((handler.label, counters) for handler in group.handlers)
        routes = data_routes([connector], self.counters)
        for route in routes.values():  # first: a handler may send from the moment in which it is bound
            self.routes[route.label] = route
            self.outbox.add_channel(route.label, route.terms, route.counters)
        self._take(connector)
        for route in routes.values():
            self.outbox.set_audience(route.label, self._with_receiver(route))
        for _, camera in handlers_of([connector], MediaTrackHandler):
            self.media.add_label(camera.label, camera.encoding, self.counters[camera.label], camera.packet_codec)
        for _, microphone in handlers_of([connector], AudioTrackHandler):
            self.media.add_microphone(microphone.label, microphone.encoding, self.counters[microphone.label])
        self._add_speakers(connector)

    def _take_over(self, connector: Connector) -> None:
        """Let a connector have the ways of the one that it replaces, which has the same ones."""
        self._take(connector)
        for fresh in data_routes([connector], self.counters).values():
            route = self.routes[fresh.label]
            route.connector, route.handler, route.safety, route.receiver = connector, fresh.handler, fresh.safety, None
            self.outbox.set_audience(route.label, self._with_receiver(route))
        self._add_speakers(connector)

    def _add_speakers(self, connector: Connector) -> None:
        for _, speaker in handlers_of([connector], AudioReceivable):
            self.talk.add_label(speaker, self._failures[speaker.label], self.counters[speaker.label])

    def _with_receiver(self, route: Route) -> RequestDesk | None:
        """Give the route its receiver, if its handler takes anything; whom answers go through."""
        if isinstance(route.handler, DataChannelReceivable):
            route.receiver = self._receiver(route, route.handler)
        return route.receiver.requests if route.receiver is not None else None

    def _ordered(self, connectors: Sequence[Connector]) -> None:
        self._connectors = tuple(connectors)
        self._groups = original_groups(connectors)
        self.outbox.taps.channels = tapped_channels(self.routes)

    def _take(self, connector: Connector) -> None:
        """Bind the handlers of a connector and prepare their bodies."""
        own_labels = _labels_of([connector])
        for handler in connector.handlers:
            self._bind(handler, own_labels)

    def _bind(self, handler: Handler, own_labels: Sequence[str]) -> None:
        host = RuntimeHost(self._loop, self.outbox, self.media, own_labels)
        handler.bind(host)
        self._losses[handler.label] = host.losses
        code = PluginCode((handler,))
        failures = Failures(handler.label, lambda *failure: self._failed.put(failure), code=code)
        self._failures[handler.label] = failures
        self._listen(handler, failures)
        runner = runner_of(handler, host, failures)
        if runner is not None:
            self._runners[handler.label] = runner
        if handler.runs == "always":
            self._always.add(handler.label)

    def _receiver(self, route: Route, handler: DataChannelReceivable[object]) -> Receiver:
        failures, requests, make_safe = self._failures[route.label], None, _safe_action_of(handler)
        if isinstance(handler, RequestHandler):
            requests = RequestDesk(handler, failures, is_motion=route.safety.is_motion)
            make_safe = requests.make_safe
        watch = self.safety.guard(route.label, route.safety, make_safe, handler.peer_left)
        self._listen(handler, _LetsGo(watch))
        return Receiver(
            handler,
            watch,
            failures,
            self._outcomes.put,
            newest_only=route.is_latest,
            limits=route.terms.limits,
            max_age_s=route.max_age_s,
            measures_of=self._links.measures_of,
            requests=requests,
        )

    @property
    def handlers(self) -> list[Handler]:
        """Those of all connectors."""
        return [handler for connector in self._connectors for handler in connector.handlers]

    # -- other connectors, while the robot runs ------------------------------------------------------------------

    async def hold(self, connectors: Sequence[Connector]) -> None:
        """Make safe what these connectors move, and let no command act on them until :meth:`resume`."""
        receivers = self._receivers_of(connectors)
        for receiver in receivers:
            receiver.hold()
        await self._make_safe(receivers, "safety.reload")

    def resume(self, connectors: Sequence[Connector]) -> None:
        """They take commands again."""
        for receiver in self._receivers_of(connectors):
            receiver.resume()

    async def retire(self, connectors: Sequence[Connector]) -> None:
        """Stop these connectors: what they move is made safe before their bodies go. Their ways stay until others take
        them over, or :meth:`become` closes them."""
        labels = _labels_of(connectors)
        receivers = self._receivers_of(connectors)
        runners = [self._runners.pop(label) for label in labels if label in self._runners]
        for receiver in receivers:
            receiver.close()
        await self._make_safe(receivers, "safety.reload")
        for runner in runners:
            runner.close()
        for _, speaker in handlers_of(connectors, AudioReceivable):
            await self.talk.remove_label(speaker.label)
        endings = [receiver.closed() for receiver in receivers]
        await asyncio.gather(*endings, *(runner.closed() for runner in runners))
        self.safety.forget([receiver.watch for receiver in receivers])
        self._always.difference_update(labels)
        self._leave_keepers(labels)

    def _listen(self, handler: Handler, listener: AbsenceListener) -> None:
        """Until the handler goes."""
        if handler.keeper is not None:
            handler.keeper.listen(listener)
            self._listeners.setdefault(handler.label, []).append((handler.keeper, listener))

    def _leave_keepers(self, labels: Sequence[str]) -> None:
        for keeper, listener in [one for label in labels for one in self._listeners.pop(label, ())]:
            keeper.ignore(listener)

    def _receivers_of(self, connectors: Sequence[Connector]) -> list[Receiver]:
        return [one for label in _labels_of(connectors) if (one := self._receiver_at(label)) is not None]

    async def _make_safe(self, receivers: Sequence[Receiver], cause: str) -> None:
        """Tell whose safe action has not ended in time, but for those that wait for their device, which is told."""
        watches = [receiver.watch for receiver in receivers]
        if not watches or await asyncio.to_thread(self.safety.make_safe, watches, cause, _SAFE_PATIENCE_S):
            return
        for receiver in receivers:
            if receiver.watch.is_unsettled and not receiver.waits_for_device:
                told, fields = (receiver.label, _SAFE_PATIENCE_S, cause), {"label": receiver.label}
                logger.error("the safe action of %r did not end within %.1f s (%s)", *told, extra=fields)

    def become(self, connectors: Sequence[Connector], replaced: Mapping[str, Connector]) -> None:
        """These are the robot's connectors from now on; those that are gone have been retired. ``replaced``: by the
        label of a new one, the retired one whose ways it takes over."""
        before = {id(connector) for connector in self._connectors}
        stays = {id(connector) for connector in connectors} | {id(connector) for connector in replaced.values()}
        for connector in self._connectors:
            if id(connector) not in stays:
                self._remove(connector)
        fresh = [connector for connector in connectors if id(connector) not in before]
        for connector in fresh:
            if connector.config.label in replaced:
                self._take_over(connector)
            else:
                self._add(connector)
        self._ordered(connectors)
        self._start(fresh)

    def _remove(self, connector: Connector) -> None:
        for handler in connector.handlers:
            self.routes.pop(handler.label, None)
            self.outbox.remove_channel(handler.label)
            self.media.remove_label(handler.label)
            self._failures.pop(handler.label, None)
            self._losses.pop(handler.label, None)
            self.counters.pop(handler.label, None)

    def _receiver_at(self, label: str) -> Receiver | None:
        route = self.routes.get(label)
        return route.receiver if route is not None else None

    # -- life ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        self.safety.start()
        self._start(self._connectors)
        self._still.start()

    def _start(self, connectors: Sequence[Connector]) -> None:
        for connector in connectors:
            for handler in connector.handlers:
                receiver, runner = self._receiver_at(handler.label), self._runners.get(handler.label)
                _look_for_keeper(handler)
                if receiver is not None:
                    receiver.start()
                if runner is not None:
                    runner.start()
                    runner.want(handler.label in self._always or self._is_wanted(handler.label))
                if isinstance(handler, AudioReceivable):
                    self.talk.start_label(handler.label)

    def _is_wanted(self, label: str) -> bool:
        """Whether anybody listens or watches, also on a channel for originals of the same connector."""
        group = self._groups.get(label, (label,))
        return bool(self.media.viewers(label)) or any(self.outbox.is_heard(one) for one in group)

    async def close(self) -> None:
        """Commands first, then what moves, then the rest."""
        self._still.close()
        receivers = self._receivers()
        for receiver in receivers:
            receiver.close()
        self.talk.close()
        for runner in self._runners.values():
            runner.close()
        await self._make_safe(receivers, "safety.shutdown")
        endings = [receiver.closed() for receiver in receivers]
        endings += [runner.closed() for runner in self._runners.values()]
        await asyncio.gather(*endings, self.talk.closed())
        self._leave_keepers(list(self._listeners))
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
        route = self.routes.get(outcome.item.channel)
        if route is None:
            return  # its connector is gone
        counters = route.counters
        if outcome.refusal is not None:
            counters.refuse(outcome.refusal.gate)
            if route.receiver is not None and route.receiver.requests is not None:
                route.receiver.requests.refused(outcome.item, outcome.refusal)
        else:
            counters.count(len(outcome.item.payload), time.monotonic())
        self.outbox.taps.commanded(outcome.item, outcome.refusal)
        self._listener.command_done(outcome)

    def _tell_failed(self, failure: tuple[str, BaseException, float]) -> None:
        self._listener.connector_failed(*failure)

    def snapshot(self, limit_factors: Mapping[str, float]) -> tuple[ConnectorSnapshot, ...]:
        """One row per entry of the catalogue, in its order. ``limit_factors``: what is left of the speed, by label of
        the receiver."""
        return tuple(
            self._rows.of(connector, group, limit_factors)
            for connector in self._connectors
            for group in connector.groups
        )


class _LetsGo:
    """Has whoever commands a kept device let go of it when it comes back."""

    def __init__(self, watch: SafetyWatch) -> None:
        self._watch = watch

    def away(self, gone: DeviceGone, tries_again_in_s: float) -> None:
        self._watch.device_changed()

    def is_back(self) -> None:
        self._watch.device_changed()


def _safe_action_of(handler: DataChannelReceivable[object]) -> Callable[[str], None]:
    """What it finds of its device, the keeper hears, which opens it again."""
    keeper = handler.keeper
    if keeper is None:
        return handler.make_safe

    def make_safe(cause: str) -> None:
        try:
            handler.make_safe(cause)
        except DeviceGone as gone:
            keeper.lost(gone)
            raise

    return make_safe


def _look_for_keeper(handler: Handler) -> None:
    """One that was never started opens nothing, and would say nothing of it."""
    if handler.keeper is not None and handler.keeper.is_stopping:
        cure = "Call its start() in __enter__ of what self.shared.get makes"
        text = f"connector %r%s: its keeper was not started, so that nothing opens its device. {cure}"
        fields = {"label": handler.label, "code": "plugin.no_device"}
        logger.error(text, handler.label, standing_at(type(handler)), extra=fields)


def _labels_of(connectors: Sequence[Connector]) -> list[str]:
    return [handler.label for connector in connectors for handler in connector.handlers]
