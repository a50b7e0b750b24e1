"""What the robot remembers of sessions without a connection: whose they are, how long, and how many."""

from __future__ import annotations

import asyncio

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.delivery.delivery_terms import terms_of
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Offered, Priority, QueueLimits
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.resumed_stream import ResumedStream
from mosaic_core.runtime.delivery.sessions import AWAY_BYTES, MAX_AWAY, SessionBook
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.words.data_type import Delivery


class Owner:
    def __init__(self) -> None:
        self.is_dispossessed = False

    def dispossessed(self) -> None:
        self.is_dispossessed = True


class Desk:
    """A book with one channel, ``events``."""

    def __init__(self, away_s: float = 60.0) -> None:
        self.counters = ConnectorCounters()
        self.outbox = Outbox(asyncio.get_running_loop(), lambda label, on: None)
        self.outbox.add_channel("events", terms_of(Delivery.RELIABLE), self.counters)
        self.book = SessionBook(self.outbox, lambda label: self.counters, away_s)

    def lost(self, session_id: str = "s", operator_id: str = "ann", boot_id: str = "page") -> None:
        owner = Owner()
        session, _ = self.book.claim(session_id, operator_id, boot_id, f"peer of {session_id}", owner)
        self.book.peer_left(session, owner, is_lost=True)


async def test_a_lost_session_is_remembered_by_its_own_page_and_by_nobody_else() -> None:
    for operator_id, boot_id, is_known in (
        ("ann", "page", True),
        ("ann", "reloaded", False),
        ("eve", "page", False),
    ):
        desk = Desk()
        desk.lost()
        assert desk.book.claim("s", operator_id, boot_id, "p2", Owner())[1] is is_known


async def test_a_good_bye_forgets_it_at_once_and_time_after_a_while() -> None:
    desk = Desk(away_s=0.01)
    owner = Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", owner)
    desk.book.peer_left(session, owner, is_lost=False)
    assert len(desk.book) == 0
    desk.lost()
    assert len(desk.book) == 1
    async with asyncio.timeout(30):
        while len(desk.book):  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def test_only_so_many_are_remembered_and_the_longest_away_goes_first() -> None:
    desk = Desk()
    for number in range(MAX_AWAY + 1):
        desk.lost(str(number))
    assert len(desk.book) == MAX_AWAY
    assert not desk.book.claim("0", "ann", "page", "p", Owner())[1]
    assert desk.book.claim("1", "ann", "page", "p", Owner())[1]
    desk.book.close()


async def test_the_next_peer_of_a_session_takes_it_from_the_one_before() -> None:
    desk = Desk()
    old, new = Owner(), Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", old)
    assert desk.book.claim("s", "ann", "page", "p2", new) == (session, True)
    assert old.is_dispossessed
    desk.book.peer_left(session, old, is_lost=False)
    assert len(desk.book) == 1


async def test_what_is_kept_for_somebody_away_is_bounded_and_counted_as_lost_at_the_end() -> None:
    desk = Desk()
    owner = Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", owner)
    desk.book.resume(session, {"events": 0}, {"events": LIMITS[Priority.RELIABLE]})
    stream = session.streams["events"]
    desk.outbox.join("events", "p1", stream)
    desk.book.peer_left(session, owner, is_lost=True)
    message = Outgoing("events", PayloadKind.BYTES, bytes(100_000), 0)
    taken = sum(stream.deliver(message) is Offered.QUEUED for _ in range(200))
    assert 0 < taken * 100_000 <= LIMITS[Priority.RELIABLE].size_bytes < AWAY_BYTES
    desk.book.close()
    assert desk.counters.lost == taken
    assert desk.outbox.listeners("events") == 0


async def test_who_leaves_on_purpose_misses_nothing_of_what_was_not_confirmed_yet() -> None:
    desk, owner = Desk(), Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", owner)
    desk.book.resume(session, {"events": 0}, {"events": LIMITS[Priority.RELIABLE]})
    stream = session.streams["events"]
    stream.attach(lambda message, flags, seq: Offered.QUEUED, lambda: (0, 0))
    assert kept(stream, 1) > 0
    desk.book.peer_left(session, owner, is_lost=False)
    assert (desk.counters.lost, len(desk.book)) == (0, 0)


def kept(stream: ResumedStream, size_bytes: int) -> int:
    """How many messages it takes."""
    message = Outgoing("events", PayloadKind.BYTES, bytes(size_bytes), 0)
    return sum(stream.deliver(message) is not Offered.REFUSED for _ in range(3000))


async def test_as_much_is_kept_as_the_file_lets_wait_but_all_channels_together_no_more_than_a_session_may() -> None:
    desk, owner = Desk(), Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", owner)
    large = QueueLimits(messages=2000, size_bytes=6 * 1024 * 1024)
    desk.book.resume(session, {"events": 0, "maps": 0}, {"events": large, "maps": large})
    desk.book.peer_left(session, owner, is_lost=True)
    assert kept(session.streams["events"], 10) == 2000
    assert 0 < kept(session.streams["maps"], 100_000) * 100_000 < 6 * 1024 * 1024
    session, _ = desk.book.claim("t", "ann", "page", "p2", owner)
    desk.book.resume(session, {"events": 0, "maps": 0}, {"events": large, "maps": large})
    desk.book.peer_left(session, owner, is_lost=True)
    both_bytes = sum(kept(session.streams[label], 100_000) for label in ("events", "maps")) * 100_000
    assert 6 * 1024 * 1024 < both_bytes <= AWAY_BYTES
    desk.book.close()


async def test_on_a_live_connection_what_went_out_is_kept_too_until_it_is_confirmed() -> None:
    desk, owner = Desk(), Owner()
    session, _ = desk.book.claim("s", "ann", "page", "p1", owner)
    desk.book.resume(session, {"events": 0}, {"events": QueueLimits(messages=10, size_bytes=1000)})
    stream, went_out = session.streams["events"], list[int]()
    stream.attach(lambda message, flags, seq: went_out.append(seq) or Offered.QUEUED, lambda: (0, 0))
    many = kept(stream, 1)
    assert many == len(went_out) > 10
    desk.book.peer_left(session, owner, is_lost=True)
    assert kept(stream, 1) == 0
    session, _ = desk.book.claim("s", "ann", "page", "p2", owner)
    desk.book.resume(session, {"events": 4}, {"events": QueueLimits(messages=10, size_bytes=1000)})
    went_out.clear()
    stream.attach(lambda message, flags, seq: went_out.append(seq) or Offered.QUEUED, lambda: (0, 0))
    assert went_out == list(range(5, many + 1))
    assert desk.counters.lost == 0
    desk.book.close()
