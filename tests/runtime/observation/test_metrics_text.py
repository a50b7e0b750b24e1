"""The metrics, as Prometheus' own parser reads them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from mosaic_core.runtime.observation.counters import (
    ConnectorSnapshot,
    LoopSnapshot,
    PeerSnapshot,
    RobotSnapshot,
    StopSnapshot,
)
from mosaic_core.runtime.observation.metrics_text import METRICS, metrics_text

ROW = ConnectorSnapshot(
    label="scan",
    type="laser-scan",
    kind="data",
    direction="to-operator",
    delivery="latest",
    state="running",
    peers=2,
    messages=100,
    rate_hz=10.0,
    size_bytes=5000,
    bytes_per_s=500.0,
    queue_messages=1,
    queue_bytes=50,
    replaced=1,
    dropped=2,
    too_large=8,
    thinned=3,
    refused=4,
    lost=5,
    resent=6,
    failures=7,
    last_error="",
    age_s=0.125,
    limit_factor=None,
)
UP = PeerSnapshot("p", "s", "o", "Alice", "operator", "open", 3.0, (), ())
ROBOT = RobotSnapshot("robot-1", "ready", 75.5, (ROW,), (UP, replace(UP, connected_s=None)))


def samples(snapshot: RobotSnapshot) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    text = metrics_text(snapshot, "mosaic-core/1")
    families = list(text_string_to_metric_families(text))
    assert all(family.documentation for family in families)
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in families
        for sample in family.samples
    }


def test_every_counter_of_a_connector_is_there_with_its_reason() -> None:
    found = samples(ROBOT)
    scan = (("connector", "scan"),)
    drops = {
        reason: found["mosaic_connector_dropped_total", (*scan, ("reason", reason))]
        for reason in ("replaced", "queue_full", "too_large", "thinned", "refused", "lost")
    }
    assert drops == {"replaced": 1, "queue_full": 2, "too_large": 8, "thinned": 3, "refused": 4, "lost": 5}
    expected = {
        "messages_total": 100, "bytes_total": 5000, "resent_total": 6, "failures_total": 7, "peers": 2,
        "queue_messages": 1, "queue_bytes": 50, "age_seconds": 0.125,
    }  # fmt: skip
    assert {name: found[f"mosaic_connector_{name}", scan] for name in expected} == expected
    assert ("mosaic_connector_speed_ratio", scan) not in found


def test_the_robot_tells_who_it_is_how_it_stands_and_who_is_connected() -> None:
    found = samples(replace(ROBOT, stop=StopSnapshot("Bob", "", 1.0)))
    assert found["mosaic_robot_info", (("robot_id", "robot-1"), ("software", "mosaic-core/1"))] == 1
    assert found["mosaic_robot_uptime_seconds", ()] == 75.5
    assert found["mosaic_robot_peers", ()] == 1
    assert found["mosaic_robot_stopped", ()] == 1
    states = {labels[0][1]: value for (name, labels), value in found.items() if name == "mosaic_robot_state"}
    assert states == {"connecting": 0, "ready": 1, "offline": 0, "stopped": 0}


def test_what_held_up_the_event_loop_is_counted_by_connector() -> None:
    found = samples(replace(ROBOT, loop=LoopSnapshot({"front": 2, "": 1}, 1.5, "front", "camera.py:42", 0.4, 3.0)))
    assert found["mosaic_loop_blocks_total", (("connector", "front"),)] == 2
    assert found["mosaic_loop_blocks_total", (("connector", ""),)] == 1
    assert found["mosaic_loop_longest_block_seconds", ()] == 1.5


def test_every_documented_metric_is_served_and_its_name_tells_its_unit() -> None:
    text = metrics_text(replace(ROBOT, connectors=(replace(ROW, limit_factor=0.5),)), "x")
    assert [line.split()[2] for line in text.splitlines() if line.startswith("# TYPE")] == list(METRICS)
    for name, (kind, _) in METRICS.items():
        assert name.endswith("_total") is (kind == "counter")


@given(st.text(st.characters(codec="utf-8", exclude_characters="\r"), max_size=40))
def test_any_text_survives_as_a_label(text: str) -> None:
    found = samples(replace(ROBOT, connectors=(replace(ROW, type=text),)))
    info = next(dict(labels) for name, labels in found if name == "mosaic_connector_info")
    assert info["type"] == text


@pytest.mark.parametrize(("age_s", "shown"), [(1e-9, 1e-9), (3.0, 3.0), (1e20, 1e20)])
def test_numbers_are_exact(age_s: float, shown: float) -> None:
    found = samples(replace(ROBOT, connectors=(replace(ROW, age_s=age_s),)))
    assert found["mosaic_connector_age_seconds", (("connector", "scan"),)] == shown
