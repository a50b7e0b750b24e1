"""The connector's choice, the file's, and what can't be meant."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.delivery_terms import chosen, contradictions, terms_of
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority, QueueLimits
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract

CLOUD = DeliveryContract(mode=Delivery.BULK, queue_messages=1, newest_wins=True)


def contract(**said: Any) -> DeliveryContract:
    return DeliveryContract.model_validate(said)


def test_a_mode_alone_has_what_the_mode_usually_has() -> None:
    for mode, priority, latch in (
        (Delivery.RELIABLE, Priority.RELIABLE, True),
        (Delivery.LATEST, Priority.LATEST, True),
        (Delivery.BULK, Priority.BULK, False),
    ):
        terms = terms_of(mode)
        assert (terms.mode, terms.priority, terms.limits, terms.latch) == (mode, priority, LIMITS[priority], latch)
        assert terms.max_rate_hz is None


def test_a_handler_may_choose_bounds_of_its_own() -> None:
    assert terms_of(CLOUD).limits == QueueLimits(1, LIMITS[Priority.BULK].size_bytes, newest_wins=True)


def test_bulk_whose_newest_wins_keeps_one_message_unless_more_are_asked_for() -> None:
    assert terms_of(contract(mode="bulk", newest_wins=True)).limits.messages == 1
    assert terms_of(contract(mode="bulk", newest_wins=True, queue_messages=5)).limits.messages == 5


def test_the_file_overrides_key_by_key_while_the_mode_stays() -> None:
    terms = terms_of(chosen(CLOUD, contract(queue_bytes=4096, latch=True)))
    assert (terms.mode, terms.limits, terms.latch) == (Delivery.BULK, QueueLimits(1, 4096, newest_wins=True), True)
    assert chosen(CLOUD, contract(mode="bulk")) == CLOUD
    assert chosen(CLOUD, None) is CLOUD


def test_another_mode_takes_nothing_over_that_was_meant_for_the_first() -> None:
    assert terms_of(chosen(CLOUD, contract(mode="reliable"))).limits == LIMITS[Priority.RELIABLE]
    assert chosen(Delivery.LATEST, contract(max_rate_hz=5)).mode is Delivery.LATEST


@pytest.mark.parametrize(
    ("said", "keys"),
    [
        ({"mode": "latest", "queue_messages": 5, "newest_wins": False}, ["queue_messages", "newest_wins"]),
        ({"mode": "latest", "queue_messages": 1, "newest_wins": True, "max_rate_hz": 5, "latch": False}, []),
        ({"mode": "reliable", "newest_wins": True}, ["newest_wins"]),
        ({"mode": "bulk", "newest_wins": True, "queue_messages": 3, "latch": True}, []),
    ],
)
def test_what_contradicts_itself_is_named_with_a_cure(said: dict[str, Any], keys: list[str]) -> None:
    found = list(contradictions(contract(**said), sends=True, is_media=False))
    assert [key for key, _, _ in found] == keys
    assert all(message and cure for _, message, cure in found)


def test_what_only_receives_has_nothing_to_pace_or_keep() -> None:
    said = contract(mode="reliable", queue_messages=5, max_rate_hz=5, latch=True)
    assert [key for key, _, _ in contradictions(said, sends=False, is_media=False)] == ["latch", "max_rate_hz"]


def test_pictures_have_bounds_of_their_own() -> None:
    assert [key for key, _, _ in contradictions(contract(mode="latest", latch=True), sends=True, is_media=True)] == [
        "latch"
    ]
    assert not list(contradictions(contract(mode="latest"), sends=True, is_media=True))


@pytest.mark.parametrize("mode", ["reliable", "bulk"])
def test_pictures_are_delivered_in_one_way(mode: str) -> None:
    assert [key for key, _, _ in contradictions(contract(mode=mode), sends=True, is_media=True)] == ["mode"]


contracts = st.builds(
    DeliveryContract,
    mode=st.none() | st.sampled_from(Delivery),
    queue_messages=st.none() | st.integers(1, 100),
    queue_bytes=st.none() | st.integers(1024, 10_000),
    max_rate_hz=st.none() | st.floats(0.1, 100),
    latch=st.none() | st.booleans(),
    newest_wins=st.none() | st.booleans(),
)


@given(own=contracts, wanted=contracts)
def test_whatever_the_file_says_counts_and_everything_is_decided(
    own: DeliveryContract, wanted: DeliveryContract
) -> None:
    terms = terms_of(chosen(own, wanted))
    limits = terms.limits
    decided = {
        "mode": terms.mode, "queue_messages": limits.messages, "queue_bytes": limits.size_bytes,
        "max_rate_hz": terms.max_rate_hz, "latch": terms.latch, "newest_wins": limits.newest_wins,
    }  # fmt: skip
    for key, value in wanted:
        assert value is None or decided[key] == value
