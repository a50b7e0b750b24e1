"""``delivery:`` in the YAML file: short and long, and what is said of mistakes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from mosaic_core.cli.configuration.config_schema import config_schema
from mosaic_core.cli.configuration.connector_description import param_tables
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority, QueueLimits
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConfigError, Problem

Terms = Callable[[str], DeliveryTerms]


@pytest.fixture
def connector(
    acme: ConnectorResolver, write: Callable[[str], Path], robot_yaml: Callable[..., str]
) -> Callable[[str], Path]:
    return lambda entry: write(robot_yaml(f"\n  - {entry}"))


@pytest.fixture
def terms(acme: ConnectorResolver, connector: Callable[[str], Path]) -> Terms:
    def terms_of(delivery: str) -> DeliveryTerms:
        path = connector(f"{{ type: gauge, label: battery, delivery: {delivery} }}")
        configured = AutoConfigurer(resolver=acme, plugins=hook_plugins([])).from_file(path, environ={})
        (made,) = configured.connectors
        return made.terms_of(made.handlers[0])

    return terms_of


@pytest.fixture
def mistakes(acme: ConnectorResolver, connector: Callable[[str], Path]) -> Callable[[str], tuple[Problem, ...]]:
    def problems_of(entry: str) -> tuple[Problem, ...]:
        with pytest.raises(ConfigError) as caught:
            AutoConfigurer(resolver=acme, plugins=hook_plugins([])).from_file(connector(entry), environ={})
        return caught.value.problems

    return problems_of


def test_a_mode_alone_is_the_short_form(terms: Terms) -> None:
    assert terms("latest").mode is Delivery.LATEST
    assert terms("{ mode: latest }") == terms("latest")


def test_the_long_form_sets_bounds_and_leaves_the_rest_to_the_connector(terms: Terms) -> None:
    long_form = terms("{ mode: reliable, queue_messages: 9, queue_bytes: 4096, max_rate_hz: 20, latch: false }")
    assert long_form == DeliveryTerms(Delivery.RELIABLE, QueueLimits(9, 4096), 20.0, False)
    assert terms("{ max_rate_hz: 5 }") == DeliveryTerms(Delivery.RELIABLE, LIMITS[Priority.RELIABLE], 5.0, True)
    assert terms("{ mode: bulk, newest_wins: true }").limits.messages == 1


@pytest.mark.parametrize(
    ("delivery", "path", "message", "cure"),
    [
        ("newst", "delivery", "expected 'reliable', 'latest' or 'bulk', got 'newst'", ""),
        ("lates", "delivery", "expected 'reliable', 'latest' or 'bulk', got 'lates'", "did you mean 'latest'?"),
        ("{ mode: balk }", "delivery.mode", "expected 'reliable', 'latest' or 'bulk'", "did you mean 'bulk'?"),
        ("{ queue_message: 5 }", "delivery.queue_message", "unknown key", "did you mean 'queue_messages'?"),
        ("{ queue_messages: 0 }", "delivery.queue_messages", "expected a number ≥ 1, got 0", ""),
        ("{ max_rate_hz: fast }", "delivery.max_rate_hz", "expected a number, got 'fast'", ""),
        ("{ mode: latest, queue_messages: 5 }", "delivery.queue_messages", "keeps one message", "`bulk`"),
        ("{ newest_wins: true }", "delivery.newest_wins", "'reliable' loses nothing", "`latest`"),
        ("[latest]", "delivery", "expected a mapping of keys to values", ""),
    ],
)
def test_a_mistake_is_told_at_its_place_with_the_nearest_name(
    mistakes: Callable[[str], tuple[Problem, ...]], delivery: str, path: str, message: str, cure: str
) -> None:
    (problem,) = mistakes(f"{{ type: gauge, label: battery, delivery: {delivery} }}")
    assert problem.path == f"connectors[0].{path}"
    assert problem.line is not None
    assert message in problem.message
    assert cure in problem.cure


def test_what_only_receives_has_no_rate_of_its_own(mistakes: Callable[[str], tuple[Problem, ...]]) -> None:
    (problem,) = mistakes("{ type: motor, label: arm, params: { pin: 1 }, delivery: { max_rate_hz: 5 } }")
    assert problem.path == "connectors[0].delivery.max_rate_hz"
    assert "safety.max_rate_hz" in problem.cure


def test_validate_says_the_same_without_a_start(acme: ConnectorResolver, connector: Callable[[str], Path]) -> None:
    path = connector("{ type: gauge, label: battery, delivery: { mode: latest, newest_wins: false } }")
    validation = validate_file(path, resolver=acme, environ={})
    rehearsal = AutoConfigurer(resolver=acme, plugins=hook_plugins([])).rehearse(validation)
    assert [one.path for one in rehearsal.problems] == ["connectors[0].delivery.newest_wins"]


def test_editors_complete_either_form(acme: ConnectorResolver) -> None:
    schema, _ = config_schema(acme)
    short, long_form = schema["$defs"]["DeliveryContract"]["anyOf"]
    assert {"enum": ["reliable", "latest", "bulk"], "type": "string"} in short["anyOf"]
    assert list(long_form["properties"]) == [
        "mode", "queue_messages", "queue_bytes", "max_rate_hz", "latch", "newest_wins"
    ]  # fmt: skip


def test_the_description_of_a_connector_lists_what_delivery_takes(acme: ConnectorResolver) -> None:
    tables = dict(param_tables(acme.resolve("gauge")))
    rows = {row[0]: row for row in tables["delivery"]}
    assert rows["mode"][1] == "'reliable' | 'latest' | 'bulk'"
    assert rows["queue_bytes"][1:4] == ("integer ≥ 1024, ≤ 268435456", "its own", "B")
