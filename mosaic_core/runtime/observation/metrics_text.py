"""The robot's counters as Prometheus reads them. Every name ends in its unit, or in ``_total``.

Imported only where metrics are asked for: most robots serve none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from prometheus_client import Metric, generate_latest
from prometheus_client.registry import Collector

from mosaic_core.runtime.observation.counters import ConnectorSnapshot, RobotSnapshot

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
ROBOT_STATES = ("connecting", "ready", "offline", "stopped")
CONNECTOR_STATES = ("waiting", "running", "failed", "ended", "stopped")

MetricSamples: TypeAlias = Iterable[tuple[Mapping[str, str], float]]

METRICS: dict[str, tuple[str, str]] = {
    "mosaic_robot_info": ("gauge", "Always 1: which robot this is."),
    "mosaic_robot_uptime_seconds": ("gauge", "Time since the robot started."),
    "mosaic_robot_state": ("gauge", "1 for the state in which the robot is toward its server, else 0."),
    "mosaic_robot_stopped": ("gauge", "1 while somebody's stop is in force."),
    "mosaic_robot_peers": ("gauge", "Operators whose peer connection is up."),
    "mosaic_loop_blocks_total": (
        "counter",
        "How often a connector's code held up the event loop; under an empty label whatever is no connector's.",
    ),
    "mosaic_loop_longest_block_seconds": ("gauge", "The longest of these times since the robot started."),
    "mosaic_connector_info": ("gauge", "Always 1: what the connector is."),
    "mosaic_connector_state": ("gauge", "1 for the state in which the connector is, else 0."),
    "mosaic_connector_peers": ("gauge", "Operators that have it open or watch it."),
    "mosaic_connector_messages_total": (
        "counter",
        "Messages made and not refused by all who listen, pictures sent, or commands carried out.",
    ),
    "mosaic_connector_bytes_total": ("counter", "Their payload."),
    "mosaic_connector_dropped_total": (
        "counter",
        "Messages that did not arrive: replaced by a newer one, queue_full, too_large, thinned by a rate limit, "
        "refused, or lost on the way.",
    ),
    "mosaic_connector_refused_total": ("counter", "Commands of operators that were refused, by the gate that did."),
    "mosaic_connector_resent_total": ("counter", "Messages repeated after a connection was lost."),
    "mosaic_connector_failures_total": ("counter", "How often its code failed and was started again."),
    "mosaic_connector_queue_messages": ("gauge", "Messages in the longest queue toward any operator."),
    "mosaic_connector_queue_bytes": ("gauge", "Bytes in that queue."),
    "mosaic_connector_age_seconds": ("gauge", "Time since the last message; absent before the first."),
    "mosaic_connector_speed_ratio": ("gauge", "What is left of the commander's speed; absent where nothing limits it."),
}
"""Every metric: its kind and what it tells."""


def metrics_text(snapshot: RobotSnapshot, software: str) -> str:
    """All metrics of ``snapshot``; ends with a line break."""
    return generate_latest(_Snapshot(snapshot, software)).decode()


class _Snapshot(Collector):
    """Collects the metrics of one look at a robot. Its counters count elsewhere, so that nothing is kept here."""

    def __init__(self, robot: RobotSnapshot, software: str) -> None:
        self._robot = robot
        self._software = software

    def collect(self) -> Iterator[Metric]:
        for name, samples in (*_robot(self._robot, self._software), *_connectors(self._robot.connectors)):
            kind, told = METRICS[name]
            metric = Metric(name.removesuffix("_total"), told, kind)
            for labels, value in samples:
                metric.add_sample(name, dict(labels), value)
            yield metric


def _robot(robot: RobotSnapshot, software: str) -> Iterator[tuple[str, MetricSamples]]:
    up = [peer for peer in robot.peers if peer.connected_s is not None]
    yield "mosaic_robot_info", [({"robot_id": robot.robot_id, "software": software}, 1)]
    yield "mosaic_robot_uptime_seconds", [({}, robot.uptime_s)]
    yield "mosaic_robot_state", [({"state": state}, state == robot.state) for state in ROBOT_STATES]
    yield "mosaic_robot_stopped", [({}, robot.stop is not None)]
    yield "mosaic_robot_peers", [({}, len(up))]
    blocks = {} if robot.loop is None else robot.loop.blocks
    yield "mosaic_loop_blocks_total", [({"connector": label}, count) for label, count in blocks.items()]
    yield "mosaic_loop_longest_block_seconds", [({}, 0.0 if robot.loop is None else robot.loop.longest_s)]


def _connectors(rows: tuple[ConnectorSnapshot, ...]) -> Iterator[tuple[str, MetricSamples]]:
    def each(value: str) -> MetricSamples:
        """What is unknown has no sample."""
        found = ((row.label, getattr(row, value)) for row in rows)
        return [({"connector": label}, number) for label, number in found if number is not None]

    info = ("type", "kind", "direction", "delivery")
    yield (
        "mosaic_connector_info",
        [({"connector": row.label, **{key: getattr(row, key) for key in info}}, 1) for row in rows],
    )
    states = [(row, state) for row in rows for state in CONNECTOR_STATES]
    yield (
        "mosaic_connector_state",
        [({"connector": row.label, "state": state}, state == row.state) for row, state in states],
    )
    yield "mosaic_connector_peers", each("peers")
    yield "mosaic_connector_messages_total", each("messages")
    yield "mosaic_connector_bytes_total", each("size_bytes")
    yield (
        "mosaic_connector_dropped_total",
        [({"connector": row.label, "reason": reason}, count) for row in rows for reason, count in _drops(row)],
    )
    yield (
        "mosaic_connector_refused_total",
        [({"connector": row.label, "gate": gate}, n) for row in rows for gate, n in sorted(row.refused_by.items())],
    )
    yield "mosaic_connector_resent_total", each("resent")
    yield "mosaic_connector_failures_total", each("failures")
    yield "mosaic_connector_queue_messages", each("queue_messages")
    yield "mosaic_connector_queue_bytes", each("queue_bytes")
    yield "mosaic_connector_age_seconds", each("age_s")
    yield "mosaic_connector_speed_ratio", each("limit_factor")


def _drops(row: ConnectorSnapshot) -> Iterator[tuple[str, int]]:
    yield "replaced", row.replaced
    yield "queue_full", row.dropped
    yield "too_large", row.too_large
    yield "thinned", row.thinned
    yield "refused", row.refused
    yield "lost", row.lost
