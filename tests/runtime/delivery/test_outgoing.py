"""From ``send`` on any thread to the pieces on a channel, with bounded queues all the way."""

from __future__ import annotations

import asyncio
import threading
import time
from typing import Any

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES
from mosaic_core.machines.delivery.send_scheduler import HIGH_WATER_BYTES, Offered, Priority, QueuedMessage, QueueLimits
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.send_queue import SendQueue
from mosaic_core.runtime.observation.counters import ConnectorCounters, RateMeter
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConnectionFailed


def message(payload: bytes = b"1", to: str | None = None) -> Outgoing:
    return Outgoing("a", PayloadKind.JSON, payload, 1, to)


class Listener:
    def __init__(self, answer: Offered = Offered.QUEUED) -> None:
        self.answer = answer
        self.got: list[bytes] = []

    def deliver(self, message: Outgoing) -> Offered:
        self.got.append(message.payload)
        return self.answer

    def waiting(self, channel: str) -> tuple[int, int]:
        return len(self.got), sum(map(len, self.got))


def outbox(
    delivery: Delivery | DeliveryContract = Delivery.RELIABLE,
) -> tuple[Outbox, ConnectorCounters, list[tuple[str, bool]]]:
    listened: list[tuple[str, bool]] = []
    it = Outbox(asyncio.get_running_loop(), lambda channel, on: listened.append((channel, on)))
    counters = ConnectorCounters()
    it.add_channel("a", terms_of(delivery), counters)
    return it, counters, listened


async def test_many_threads_hand_over_everything_in_their_own_order_with_few_wake_ups(kit: Any) -> None:
    loop, wake_ups = asyncio.get_running_loop(), 0
    got: list[tuple[int, int]] = []
    handover: Handover[tuple[int, int]] = Handover(loop, got.append, max_items=100_000)
    real = loop.call_soon_threadsafe

    def counted(*arguments: Any, **options: Any) -> Any:
        nonlocal wake_ups
        wake_ups += 1
        return real(*arguments, **options)

    loop.call_soon_threadsafe = counted  # type: ignore[assignment,method-assign]
    threads = [
        threading.Thread(target=lambda who=who: [handover.put((who, number)) for number in range(2000)])
        for who in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        await asyncio.to_thread(thread.join)
    await kit.until(lambda: len(got) == 8000)
    for who in range(4):
        assert [number for sender, number in got if sender == who] == list(range(2000))
    assert wake_ups < 4000


async def test_a_full_handover_refuses_instead_of_growing(kit: Any) -> None:
    handover: Handover[int] = Handover(asyncio.get_running_loop(), lambda _: None, max_items=3)
    assert [handover.put(number) for number in range(5)] == [True, True, True, False, False]


def test_a_handover_to_a_closed_loop_is_false() -> None:
    loop = asyncio.new_event_loop()
    handover: Handover[int] = Handover(loop, lambda _: None)
    loop.close()
    assert handover.put(1) is False


async def test_send_is_false_while_nobody_listens_and_the_value_waits_for_the_first_who_does(kit: Any) -> None:
    it, counters, listened = outbox()
    assert it.post(message(b"7")) is False
    await asyncio.sleep(0)
    latched = it.join("a", "p1", Listener())
    assert latched is not None
    assert latched.payload == b"7"
    assert counters.messages == 1
    assert it.post(message()) is True
    assert it.post(message(to="p2")) is False
    it.leave("a", "p1")
    it.leave("a", "p1")
    assert listened == [("a", True), ("a", False)]
    assert it.join("unknown", "p1", Listener()) is None


async def test_bulk_and_answers_to_one_are_not_kept_for_late_joiners(kit: Any) -> None:
    bulk, counters, _ = outbox(Delivery.BULK)
    bulk.join("a", "p0", Listener())
    bulk.post(message())
    await kit.until(lambda: counters.messages == 1)
    assert bulk.join("a", "p1", Listener()) is None
    plain, counters, _ = outbox()
    first, second = Listener(), Listener()
    plain.join("a", "p1", first)
    plain.join("a", "p2", second)
    plain.post(message(b"mine", to="p2"))
    await kit.until(lambda: second.got == [b"mine"])
    assert first.got == []
    assert plain.join("a", "p3", Listener()) is None


async def test_a_sender_learns_that_every_queue_is_full_and_when_there_is_room(kit: Any) -> None:
    it, counters, _ = outbox()
    it.join("a", "p1", Listener(Offered.REFUSED))
    assert it.post(message()) is True
    await kit.until(lambda: counters.dropped == 1)
    assert it.post(message()) is False
    it.join("a", "p2", Listener())
    assert it.post(message()) is True
    it.leave("a", "p2")
    it.has_room("a", "p1")
    assert it.post(message()) is True


async def test_a_message_that_no_peer_could_take_is_refused_at_once(kit: Any, caplog: Any) -> None:
    it, counters, _ = outbox()
    it.join("a", "p1", Listener())
    for _ in range(2):
        assert it.post(message(bytes(MAX_MESSAGE_BYTES + 1))) is False
    assert (counters.too_large, counters.dropped, counters.messages) == (2, 0, 0)
    assert caplog.text.count("too large to send") == 1


async def test_the_queue_waits_while_the_buffer_is_long_and_goes_on_when_it_drains(kit: Any) -> None:
    channel = kit.channel("a")
    rooms: list[str] = []
    queue = SendQueue(rooms.append)
    queue.open(channel, Priority.RELIABLE)
    channel.buffered_bytes = HIGH_WATER_BYTES
    offered = [queue.offer(QueuedMessage("a", iter((b"x",)), 1)) for _ in range(600)]
    assert channel.sent == []
    assert offered.count(Offered.REFUSED) == 600 - 512
    channel.buffered_bytes = 0
    channel.on_drained()
    await kit.until(lambda: len(channel.sent) == 512)
    assert rooms == ["a"]


async def test_messages_whose_place_a_larger_one_takes_are_all_counted(kit: Any) -> None:
    it, counters, _ = outbox(DeliveryContract(mode=Delivery.BULK, newest_wins=True, queue_messages=9))
    channel, queue = kit.channel("a"), SendQueue(it.has_room, it.left_out)
    channel.buffered_bytes = HIGH_WATER_BYTES
    queue.open(channel, Priority.BULK, QueueLimits(messages=9, size_bytes=10, newest_wins=True))

    class Peer(Listener):
        def deliver(self, message: Outgoing) -> Offered:
            size_bytes = len(message.payload)
            return queue.offer(QueuedMessage("a", iter((message.payload,)), size_bytes))

    it.join("a", "p1", Peer())
    for size_bytes in (3, 3, 3, 10):
        it.post(message(bytes(size_bytes)))
    await kit.until(lambda: counters.messages == 4)
    assert (counters.replaced, counters.dropped) == (3, 0)
    queue.close_all()


async def test_what_a_channel_finds_too_large_is_counted_each_time_and_logged_once(kit: Any, caplog: Any) -> None:
    it, counters, _ = outbox()
    channel, queue = kit.channel("a"), SendQueue(it.has_room, it.left_out)

    def refuse(data: bytes | str) -> None:
        raise ConnectionFailed("64 KiB at most", code="channel.too_large")

    channel.send = refuse
    queue.open(channel, Priority.RELIABLE)
    for _ in range(3):
        assert queue.offer(QueuedMessage("a", iter((b"large",)), 5)) is Offered.QUEUED
    assert counters.too_large == 3
    assert caplog.text.count("is left out") == 1


async def test_a_drain_that_nobody_reported_is_noticed(kit: Any) -> None:
    channel = kit.channel("a")
    queue = SendQueue(lambda _: None)
    queue.open(channel, Priority.RELIABLE)
    channel.buffered_bytes = HIGH_WATER_BYTES
    queue.offer(QueuedMessage("a", iter((b"x",)), 1))
    channel.buffered_bytes = 0
    await kit.until(lambda: channel.sent == [b"x"])


async def test_a_channel_that_is_gone_is_forgotten(kit: Any) -> None:
    channel = kit.channel("a")
    queue = SendQueue(lambda _: None)
    queue.open(channel, Priority.RELIABLE)
    channel.is_open = False
    queue.offer(QueuedMessage("a", iter((b"x",)), 1))
    assert queue.offer(QueuedMessage("a", iter((b"x",)), 1)) is Offered.REFUSED
    queue.close_all()


def test_rates_are_means_over_the_window() -> None:
    meter = RateMeter()
    for number in range(40):
        meter.add(100, number * 0.05)
    assert meter.rates(1.99) == (20.0, 2000.0)
    assert meter.rates(10.0) == (0.0, 0.0)


async def test_a_message_for_full_queues_alone_goes_nowhere(kit: Any) -> None:
    it, counters, _ = outbox()
    full = Listener(Offered.REFUSED)
    it.join("a", "p1", full)
    it.post(message(b"1"))
    await kit.until(lambda: counters.dropped == 1)
    full.answer = Offered.QUEUED
    assert it.post(message(b"2")) is False
    assert it.post(message(b"3", to="p1")) is False
    it.has_room("a", "p1")
    assert it.post(message(b"4")) is True
    await kit.until(lambda: full.got == [b"1", b"4"])
    assert (counters.dropped, counters.messages) == (3, 1)


async def test_an_answer_to_somebody_who_is_gone_is_lost_and_no_queue_was_full(kit: Any) -> None:
    it, counters, _ = outbox()
    it.join("a", "p1", Listener())
    assert it.post(message(to="p2")) is False
    await kit.until(lambda: counters.lost == 1)
    assert (counters.dropped, counters.messages) == (0, 0)


async def test_what_all_refused_does_not_count_and_what_nobody_listens_to_does(kit: Any) -> None:
    it, counters, _ = outbox()
    it.join("a", "p1", Listener(Offered.REFUSED))
    it.post(message(b"refused"))
    await kit.until(lambda: counters.dropped == 1)
    await asyncio.sleep(0)
    assert (counters.messages, counters.size_bytes, counters.last_at_s) == (0, 0, None)
    assert counters.meter.rates(time.monotonic()) == (0.0, 0.0)
    it.join("a", "p2", Listener(Offered.REPLACED))
    it.post(message(b"taken by one"))
    await kit.until(lambda: counters.messages == 1)
    assert (counters.size_bytes, counters.dropped, counters.replaced) == (12, 2, 1)
    assert counters.last_at_s is not None
    it.leave("a", "p1")
    it.leave("a", "p2")
    it.post(message(b"a sign of life"))
    await kit.until(lambda: counters.messages == 2)


async def test_values_are_thinned_to_their_rate_and_the_newest_arrives(kit: Any) -> None:
    it, counters, _ = outbox(DeliveryContract(mode=Delivery.LATEST, max_rate_hz=20))
    listener = Listener()
    it.join("a", "p1", listener)
    for number in range(50):
        assert it.post(message(b"%d" % number)) is True
    it.post(message(b"answer", to="p1"))
    await kit.until(lambda: listener.got[-1:] == [b"49"])
    assert listener.got == [b"0", b"answer", b"49"]
    assert (counters.thinned, counters.messages) == (48, 3)
    latched = it.join("a", "p2", Listener())
    assert latched is not None
    assert latched.payload == b"49"


async def test_other_messages_beyond_the_rate_are_refused_to_their_sender(kit: Any) -> None:
    it, counters, _ = outbox(DeliveryContract(max_rate_hz=4))
    listener = Listener()
    it.join("a", "p1", listener)
    accepted = [it.post(message(b"%d" % number)) for number in range(10)]
    assert accepted == [True] * 2 + [False] * 8
    assert it.post(message(b"answer", to="p1")) is True
    await kit.until(lambda: len(listener.got) == 3)
    assert counters.thinned == 8


async def test_latching_can_be_switched_off_and_for_bulk_on_within_its_bound(kit: Any) -> None:
    off, counters, _ = outbox(DeliveryContract(latch=False))
    off.join("a", "p0", Listener())
    off.post(message())
    await kit.until(lambda: counters.messages == 1)
    assert off.join("a", "p1", Listener()) is None
    bulk, counters, _ = outbox(DeliveryContract(mode=Delivery.BULK, latch=True, queue_bytes=1024))
    bulk.join("a", "p0", Listener())
    bulk.post(message(b"small"))
    bulk.post(message(bytes(1025)))
    await kit.until(lambda: counters.messages == 2)
    latched = bulk.join("a", "p1", Listener())
    assert latched is not None
    assert latched.payload == b"small"


async def test_the_longest_queue_of_any_peer_is_told(kit: Any) -> None:
    it, counters, _ = outbox()
    assert it.waiting("a") == (0, 0)
    assert it.waiting("unknown") == (0, 0)
    for peer_id in ("p1", "p2"):
        it.join("a", peer_id, Listener())
    it.post(message(b"12", to="p2"))
    it.post(message(b"345", to="p2"))
    await kit.until(lambda: counters.messages == 2)
    assert it.waiting("a") == (2, 5)
