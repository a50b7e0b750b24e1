"""Control before latest before reliable before bulk, and nothing waits in SCTP that could wait here."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.send_scheduler import (
    HIGH_WATER_BYTES,
    LEAST_HIGH_WATER_BYTES,
    LIMITS,
    LOW_WATER_BYTES,
    PIECE_COST_BYTES,
    Offered,
    Priority,
    QueuedMessage,
    QueueLimits,
    SendScheduler,
    high_water_bytes,
)


def message(channel: str, *pieces: bytes) -> QueuedMessage:
    return QueuedMessage(channel, iter(pieces), sum(len(piece) for piece in pieces))


def scheduler(**channels: Priority) -> SendScheduler:
    it = SendScheduler()
    for channel, priority in channels.items():
        it.open(channel, priority)
    return it


def drained(it: SendScheduler, buffered_bytes: int = 0) -> list[tuple[str, bytes | str]]:
    taken = []
    while (piece := it.take(buffered_bytes)) is not None:
        taken.append(piece)
    return taken


def test_the_priorities_go_in_the_order_of_their_urgency() -> None:
    it = scheduler(bulk=Priority.BULK, event=Priority.RELIABLE, pose=Priority.LATEST, control=Priority.CONTROL)
    for channel in ("bulk", "event", "pose", "control"):
        it.offer(message(channel, channel.encode()))
    assert [channel for channel, _ in drained(it)] == ["control", "pose", "event", "bulk"]
    assert it.is_idle


def test_a_stop_overtakes_the_rest_of_a_map() -> None:
    it = scheduler(map=Priority.BULK, control=Priority.CONTROL)
    it.offer(message("map", b"1", b"2", b"3"))
    assert it.take(0) == ("map", b"1")
    it.offer(message("control", b"stop"))
    assert drained(it) == [("control", b"stop"), ("map", b"2"), ("map", b"3")]


def test_a_newer_value_replaces_one_that_waits() -> None:
    it = scheduler(pose=Priority.LATEST)
    assert it.offer(message("pose", b"old")) is Offered.QUEUED
    assert it.offer(message("pose", b"new")) is Offered.REPLACED
    assert drained(it) == [("pose", b"new")]
    assert (it.counters.replaced, it.counters.sent_bytes) == (1, 3)


def test_a_value_whose_sending_has_begun_is_finished_before_the_newer_one() -> None:
    it = scheduler(scan=Priority.LATEST)
    it.offer(message("scan", b"a1", b"a2"))
    assert it.take(0) == ("scan", b"a1")
    assert it.offer(message("scan", b"b")) is Offered.QUEUED
    assert drained(it) == [("scan", b"a2"), ("scan", b"b")]


def test_channels_of_one_priority_take_turns() -> None:
    it = scheduler(a=Priority.RELIABLE, b=Priority.RELIABLE)
    for _ in range(2):
        it.offer(message("a", b"a"))
        it.offer(message("b", b"b"))
    assert [channel for channel, _ in drained(it)] == ["a", "b", "a", "b"]


def test_a_full_queue_refuses_and_says_when_there_is_room_again() -> None:
    it = SendScheduler()
    it.open("a", Priority.RELIABLE, QueueLimits(messages=4, size_bytes=100))
    assert [it.offer(message("a", b"x")) for _ in range(5)] == [Offered.QUEUED] * 4 + [Offered.REFUSED]
    assert not it.has_room("a")
    assert it.waiting("a") == (4, 4)
    for _ in range(3):
        it.take(0)
    assert it.has_room("a")
    assert it.counters.refused == 1


def test_one_message_larger_than_the_queue_is_taken_while_nothing_waits() -> None:
    it = SendScheduler()
    it.open("a", Priority.BULK, QueueLimits(messages=4, size_bytes=10))
    assert it.offer(message("a", b"x" * 50)) is Offered.QUEUED
    assert it.offer(message("a", b"x")) is Offered.REFUSED


@pytest.mark.parametrize(
    ("priority", "sends_below", "waits_at"),
    [
        (Priority.CONTROL, HIGH_WATER_BYTES, 4 * HIGH_WATER_BYTES),
        (Priority.LATEST, LOW_WATER_BYTES - 1, LOW_WATER_BYTES),
        (Priority.RELIABLE, HIGH_WATER_BYTES - 1, HIGH_WATER_BYTES),
        (Priority.BULK, HIGH_WATER_BYTES // 2 - 1, HIGH_WATER_BYTES // 2),
    ],
)
def test_each_priority_waits_for_its_own_buffer_level(priority: Priority, sends_below: int, waits_at: int) -> None:
    it = scheduler(a=priority)
    it.offer(message("a", b"x"))
    assert it.take(waits_at) is None
    assert it.take(sends_below) == ("a", b"x")


def test_a_closed_channel_forgets_what_waited_and_can_open_again() -> None:
    it = scheduler(a=Priority.RELIABLE)
    it.offer(message("a", b"x"))
    it.open("a", Priority.RELIABLE)
    assert it.take(0) is None
    it.close("a")
    it.close("a")
    assert it.waiting("a") == (0, 0)
    assert it.has_room("a")
    with pytest.raises(KeyError):
        it.offer(message("a", b"x"))


Offer = st.tuples(st.sampled_from(["control", "pose", "event", "map"]), st.integers(1, 3), st.integers(0, 90_000))


@given(st.lists(Offer, max_size=60))
def test_everything_reliable_arrives_complete_and_in_order(offers: list[tuple[str, int, int]]) -> None:
    it = scheduler(control=Priority.CONTROL, pose=Priority.LATEST, event=Priority.RELIABLE, map=Priority.BULK)
    expected: dict[str, list[bytes]] = {"control": [], "event": [], "map": []}
    sent: dict[str, list[bytes | str]] = {"control": [], "event": [], "map": [], "pose": []}
    for number, (channel, count, buffered_bytes) in enumerate(offers):
        pieces = [f"{number}.{part}".encode() for part in range(count)]
        if it.offer(message(channel, *pieces)) is not Offered.REFUSED and channel != "pose":
            expected[channel] += pieces
        taken = it.take(buffered_bytes)
        if taken is not None:
            sent[taken[0]].append(taken[1])
    for channel, piece in drained(it):
        sent[channel].append(piece)
    assert {key: sent[key] for key in expected} == expected
    assert it.is_idle


def on_a_link(it: SendScheduler, offers: dict[str, int], *, turns: int, per_turn_bytes: int) -> dict[str, int]:
    """What each channel gets while all offer a message of so many bytes per turn, and the buffer drains as slowly."""
    sent, buffered_bytes = dict.fromkeys(offers, 0), 0
    for _ in range(turns):
        for channel, size_bytes in offers.items():
            it.offer(message(channel, bytes(size_bytes)))
        while (taken := it.take(buffered_bytes, 4 * per_turn_bytes)) is not None:
            sent[taken[0]] += len(taken[1])
            buffered_bytes += len(taken[1])
        buffered_bytes = max(0, buffered_bytes - per_turn_bytes)
    return sent


def test_the_newest_value_gets_through_beside_whoever_sends_without_end() -> None:
    it = scheduler(pose=Priority.LATEST, event=Priority.RELIABLE, map=Priority.BULK)
    sent = on_a_link(it, {"pose": 100, "event": 4000, "map": 16_000}, turns=500, per_turn_bytes=4000)
    assert sent["pose"] >= 100 * 500 / 6, "a piece of a map takes four turns, and pose goes before the next one"


def test_priorities_that_outrun_the_link_together_share_it_and_none_starves() -> None:
    it = scheduler(pose=Priority.LATEST, event=Priority.RELIABLE, map=Priority.BULK)
    sent = on_a_link(it, {"pose": 8000, "event": 8000, "map": 8000}, turns=2000, per_turn_bytes=6000)
    assert sent["pose"] > sent["event"] > sent["map"] > 0.02 * sum(sent.values())


def test_a_priority_that_was_idle_has_saved_nothing_up() -> None:
    it = scheduler(event=Priority.RELIABLE, map=Priority.BULK)
    on_a_link(it, {"map": 8000}, turns=300, per_turn_bytes=8000)
    sent = on_a_link(it, {"event": 8000, "map": 8000}, turns=300, per_turn_bytes=8000)
    assert sent["map"] > 0.1 * sum(sent.values())


def test_while_a_value_waits_nobody_fills_the_buffer_over_its_ceiling() -> None:
    it = scheduler(pose=Priority.LATEST, event=Priority.RELIABLE)
    it.offer(message("event", b"e"))
    assert it.take(LOW_WATER_BYTES) == ("event", b"e")
    it.offer(message("event", b"e"))
    it.offer(message("pose", b"p"))
    assert it.take(LOW_WATER_BYTES) is None
    assert [channel for channel, _ in drained(it)] == ["pose", "event"]
    it.offer(message("event", b"e"))
    assert it.take(LOW_WATER_BYTES) == ("event", b"e")


@given(st.integers(0, 10_000_000))
def test_on_a_slow_path_less_waits_below_but_never_nothing(window_bytes: int) -> None:
    high = high_water_bytes(window_bytes)
    assert LEAST_HIGH_WATER_BYTES <= high <= HIGH_WATER_BYTES
    assert high <= max(LEAST_HIGH_WATER_BYTES, window_bytes / 4)
    it = scheduler(event=Priority.RELIABLE)
    it.offer(message("event", b"x"))
    assert it.take(high, window_bytes) is None
    assert it.take(high - 4, window_bytes) == ("event", b"x")


def test_a_full_queue_whose_newest_wins_loses_its_oldest() -> None:
    it = SendScheduler()
    it.open("cloud", Priority.BULK, QueueLimits(messages=2, size_bytes=100, newest_wins=True))
    offered = [it.offer(message("cloud", bytes([number]))) for number in range(5)]
    assert offered == [Offered.QUEUED] * 2 + [Offered.REPLACED] * 3
    assert it.waiting("cloud") == (2, 2)
    assert drained(it) == [("cloud", b"\3"), ("cloud", b"\4")]
    assert (it.counters.replaced, it.counters.refused) == (3, 0)


def test_a_newest_message_larger_than_the_queue_takes_the_place_of_all() -> None:
    it = SendScheduler()
    it.open("cloud", Priority.BULK, QueueLimits(messages=5, size_bytes=10, newest_wins=True))
    it.offer(message("cloud", b"a"))
    it.offer(message("cloud", b"b"))
    assert it.offer(message("cloud", b"x" * 50)) is Offered.REPLACED
    assert it.waiting("cloud") == (1, 50)


def test_small_messages_get_their_share_of_the_bytes_beside_large_ones() -> None:
    it = scheduler(log=Priority.RELIABLE, map=Priority.RELIABLE)
    limits = QueueLimits(messages=10_000, size_bytes=10**9)
    it.open("log", Priority.RELIABLE, limits)
    it.open("map", Priority.RELIABLE, limits)
    for _ in range(50):
        it.offer(message("map", b"m" * 60_000))
    for _ in range(2000):
        it.offer(message("log", b"l" * 100))
    sent = {"log": 0, "map": 0}
    while sent["map"] < 5 * 60_000:
        channel, piece = it.take(0) or ("", b"")
        sent[channel] += len(piece)
    assert sent["log"] > 100 * 1000, "by turns it would be one hundred bytes for sixty thousand"


def test_having_been_idle_earns_nothing() -> None:
    it = scheduler(old=Priority.RELIABLE, new=Priority.RELIABLE)
    for _ in range(100):
        it.offer(message("old", b"x" * 1000))
        it.take(0)
    for _ in range(10):
        it.offer(message("old", b"x" * 1000))
        it.offer(message("new", b"x" * 1000))
    first = [channel for channel, _ in drained(it)][:10]
    assert abs(first.count("old") - first.count("new")) <= 1


def test_a_channel_that_is_opened_anew_in_its_turn_sends_nothing_of_before() -> None:
    it = scheduler(a=Priority.RELIABLE, b=Priority.RELIABLE)
    it.offer(message("a", b"old", b"older"))
    it.offer(message("b", b"b"))
    it.take(0)
    it.open("a", Priority.BULK)
    it.offer(message("a", b"new"))
    assert sorted(drained(it)) == [("a", b"new"), ("b", b"b")]


KINDS = {
    "control": (Priority.CONTROL, None),
    "pose": (Priority.LATEST, None),
    "event": (Priority.RELIABLE, QueueLimits(messages=4, size_bytes=200)),
    "log": (Priority.RELIABLE, QueueLimits(messages=8, size_bytes=300)),
    "map": (Priority.BULK, QueueLimits(messages=3, size_bytes=400)),
    "cloud": (Priority.BULK, QueueLimits(messages=2, size_bytes=400, newest_wins=True)),
}
Act = st.one_of(
    st.tuples(st.just("offer"), st.sampled_from(sorted(KINDS)), st.integers(1, 150)),
    st.tuples(
        st.just("take"), st.sampled_from([0, LOW_WATER_BYTES, HIGH_WATER_BYTES // 2, HIGH_WATER_BYTES]), st.just(0)
    ),
)


@given(st.lists(Act, max_size=120))
def test_on_any_walk_bounds_hold_order_holds_and_the_newest_value_is_the_last_to_go(
    acts: list[tuple[Any, ...]],
) -> None:
    it = SendScheduler()
    for channel, (priority, limits) in KINDS.items():
        it.open(channel, priority, limits)
    accepted: dict[str, list[int]] = {channel: [] for channel in KINDS}
    sent: dict[str, list[int]] = {channel: [] for channel in KINDS}
    for number, (act, what, size) in enumerate(acts):
        if act == "take":
            taken = it.take(what)
            if taken is not None:
                assert isinstance(taken[1], bytes)
                sent[taken[0]].append(int(taken[1].split(b".")[0]))
            continue
        pieces = [f"{number}.".encode().ljust(size, b"x")]
        if it.offer(message(what, *pieces)) is not Offered.REFUSED:
            accepted[what].append(number)
        messages, size_bytes = it.waiting(what)
        priority, limits = KINDS[what]
        limits = limits or LIMITS[priority]
        assert messages <= limits.messages
        assert size_bytes <= limits.size_bytes or messages == 1
    for channel, piece in drained(it):
        assert isinstance(piece, bytes)
        sent[channel].append(int(piece.split(b".")[0]))
    assert it.is_idle
    for channel, numbers in sent.items():
        assert numbers == sorted(numbers)
        if channel in ("pose", "cloud"):
            assert numbers[-1:] == accepted[channel][-1:]
        else:
            assert numbers == accepted[channel]


@given(st.lists(st.tuples(st.integers(2, 2000), st.integers(1, 4)), min_size=2, max_size=5))
def test_no_channel_of_a_priority_starves_whatever_the_others_send(loads: list[tuple[int, int]]) -> None:
    """Each always has something to send; after a while each has had its share, give or take one message."""
    it = SendScheduler()
    limits = QueueLimits(messages=10, size_bytes=10**9)
    for index in range(len(loads)):
        it.open(str(index), Priority.BULK, limits)
    cost = dict.fromkeys(map(str, range(len(loads))), 0)
    for _ in range(400):
        for index, (size, pieces) in enumerate(loads):
            while it.waiting(str(index))[0] < 2:
                it.offer(message(str(index), *[b"x" * size] * pieces))
        channel, piece = it.take(0) or ("", b"")
        cost[channel] += len(piece) + PIECE_COST_BYTES
    largest = max(size for size, _ in loads) + PIECE_COST_BYTES
    assert max(cost.values()) - min(cost.values()) <= 2 * largest
