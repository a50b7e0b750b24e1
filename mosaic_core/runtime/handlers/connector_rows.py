"""Reads how each connector of a robot does, for tables, reports and metrics."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import get_args

from mosaic_core.contract.host import Loss
from mosaic_core.runtime.configuration.connector import Connector, HandlerGroup
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.handlers.runner import Runner
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.observation.counters import ConnectorCounters, ConnectorSnapshot, HandlerLosses
from mosaic_core.runtime.threads.failures import Failures

_WORST_FIRST = ("failed", "running", "waiting", "ended", "stopped")


@dataclass(frozen=True, slots=True)
class ConnectorRows:
    """Looks at what runs the handlers: routes, counters, runners, failures and losses by the handler's label. Event
    loop only."""

    routes: Mapping[str, Route]
    counters: Mapping[str, ConnectorCounters]
    outbox: Outbox
    media: MediaHub
    runners: Mapping[str, Runner]
    failures: Mapping[str, Failures]
    losses: Mapping[str, HandlerLosses]

    def of(self, connector: Connector, group: HandlerGroup, limit_factors: Mapping[str, float]) -> ConnectorSnapshot:
        """The row of the handlers of ``connector`` that operators see as one."""
        labels, first = [handler.label for handler in group.handlers], group.handlers[0]
        now_s, counters = time.monotonic(), self.counters[labels[0]]
        rate_hz, bytes_per_s = counters.meter.rates(now_s)
        failing = [self.failures[label] for label in labels]
        states = [self._state(label) for label in labels]
        worst = next((one for one, state in zip(failing, states, strict=True) if state == "failed"), None)
        queue_messages, queue_bytes = max(map(self._waiting, labels))
        lost = {reason: getattr(counters, reason) + self._left_out(labels, reason) for reason in get_args(Loss)}
        lost["replaced"] += self._replaced_in(labels)
        return ConnectorSnapshot(
            label=group.label,
            type=connector.config.type,
            kind=str(first.kind),
            direction=str(group.direction),
            delivery=str(connector.terms_of(first).mode),
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
        return sum(self.losses[label][reason] for label in labels)

    def _state(self, label: str) -> str:
        runner, route = self.runners.get(label), self.routes.get(label)
        # what only receives has nothing to restart: after its rest it takes the next message
        rested = runner is None and route is not None and route.receiver is not None and not route.receiver.is_resting
        failures = self.failures[label]
        if failures.is_away or (failures.is_failing and not rested):
            return "failed"
        return runner.state if runner is not None else "running"
