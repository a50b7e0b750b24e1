"""Sender and receiver of a channel that outlives its connections: exactly once and in order, or counted as lost."""

from __future__ import annotations

from collections import deque

from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.delivery.framing import SEQ_MODULUS
from mosaic_core.machines.delivery.resume import Arrival, Numbered, ResumeLimits, ResumeReceiver, ResumeSender

LIMITS = ResumeLimits(messages=4, size_bytes=40, age_s=10.0, in_flight_messages=3, in_flight_bytes=30)


def sender_with(*items: str, attached: bool = True) -> ResumeSender[str]:
    sender: ResumeSender[str] = ResumeSender(LIMITS)
    if attached:
        sender.resumed(0)
    for item in items:
        assert sender.accept(item, 1, 0.0)
    return sender


def sent(sender: ResumeSender[str]) -> list[Numbered[str]]:
    found = []
    while (message := sender.upcoming()) is not None:
        found.append(message)
        sender.went_out()
    return found


def test_messages_are_numbered_from_one_and_kept_until_they_are_delivered() -> None:
    sender = sender_with("a", "b")
    assert sent(sender) == [Numbered(1, "a"), Numbered(2, "b")]
    assert sender.unconfirmed == 2
    sender.delivered(1)
    assert sender.unconfirmed == 1
    assert sender.waiting == 0


def test_what_was_not_delivered_is_repeated_in_order_on_the_next_connection() -> None:
    sender = sender_with("a", "b", "c")
    sent(sender)
    sender.detached()
    assert sender.accept("d", 1, 1.0)
    assert sender.upcoming() is None
    assert sender.resumed(1) == 0
    assert sent(sender) == [Numbered(2, "b", True), Numbered(3, "c", True), Numbered(4, "d")]
    assert sender.resent == 2


def test_a_sender_whose_queue_is_full_while_nobody_is_there_is_refused() -> None:
    sender = sender_with("a", "b", "c", "d", attached=False)
    assert not sender.accept("e", 1, 0.0)
    sender.resumed(0)
    assert [message.seq for message in sent(sender)] == [1, 2, 3, 4]


def test_what_was_accepted_is_kept_until_it_is_confirmed_however_much_has_gone_out() -> None:
    sender = sender_with("a", "b", "c", "d")
    sent(sender)
    taken = [sender.accept(item, 1, 0.0) for item in "efgh"]
    assert taken == [True, True, True, False], "a live connection may have more under way than waits in a queue"
    sent(sender)
    sender.detached()
    assert not sender.accept("h", 1, 0.0)
    assert sender.resumed(0) == 0
    assert [message.seq for message in sent(sender)] == [1, 2, 3, 4, 5, 6, 7]


def test_what_is_confirmed_makes_room() -> None:
    sender = sender_with("a", "b", "c", "d")
    sent(sender)
    assert [sender.accept(item, 1, 0.0) for item in "efgh"][-1] is False
    sender.delivered(1)
    assert sender.has_room(1, 0.0)
    assert sender.accept("h", 1, 0.0)


def test_no_more_than_a_queue_waits_to_go_out_on_a_live_connection_either() -> None:
    sender = sender_with("a", "b", "c", "d")
    assert not sender.accept("e", 1, 0.0)
    sender.went_out()
    assert sender.accept("e", 1, 0.0)


def test_bytes_bound_the_queue_but_one_message_of_any_size_is_taken() -> None:
    sender: ResumeSender[str] = ResumeSender(LIMITS)
    assert sender.accept("large", 1000, 0.0)
    assert not sender.accept("small", 1, 0.0)
    assert sender.size_bytes == 1000


def test_what_waited_too_long_is_lost_though_nothing_came_after_it() -> None:
    sender = sender_with("a", attached=False)
    sender.forget_old(10.0)
    assert sender.unconfirmed == 1
    sender.forget_old(10.5)
    assert sender.resumed(0) == 1
    assert sent(sender) == []


def test_what_waited_too_long_is_lost() -> None:
    sender = sender_with("a", attached=False)
    assert sender.accept("b", 1, 10.5)
    assert sender.resumed(0) == 1
    assert sent(sender) == [Numbered(2, "b")]


def test_who_says_nothing_else_has_what_the_page_about_roaming_promises() -> None:
    """docs/topics/roaming.md: as much as a queue holds, more on a live connection, for 60 seconds."""
    away: ResumeSender[str] = ResumeSender()
    assert [away.accept("a", 1, 0.0) for _ in range(513)] == [True] * 512 + [False]
    away.forget_old(60.0)
    assert away.unconfirmed == 512
    away.forget_old(60.001)
    assert away.resumed(0) == 512
    assert taken_in_pieces(ResumeSender(), 2**20) == 2
    live: ResumeSender[str] = ResumeSender()
    live.resumed(0)
    assert taken_in_pieces(live, 2**20) == 18
    live = ResumeSender()
    live.resumed(0)
    assert taken_in_pieces(live, 1) == 512 + 4096


def taken_in_pieces(sender: ResumeSender[str], size_bytes: int) -> int:
    """How many of this size it takes, if what may go out does so at once."""
    taken = 0
    while sender.accept("a", size_bytes, 0.0):
        taken += 1
        sent(sender)
    return taken


def test_a_number_that_was_never_sent_is_not_believed() -> None:
    sender = sender_with("a", "b")
    sender.delivered(2)
    assert sender.unconfirmed == 2
    sent(sender)
    sender.delivered(7)
    assert sender.unconfirmed == 2


def test_whatever_went_out_can_be_confirmed_at_once_and_the_rest_still_waits() -> None:
    sender = sender_with("a", "b", "c")
    sender.went_out()
    sender.went_out()
    sender.all_delivered()
    assert (sender.unconfirmed, sender.abandoned()) == (1, 1)


def test_a_receiver_without_memory_is_sent_only_what_never_went_out() -> None:
    sender = sender_with("a", "b")
    sent(sender)
    sender.detached()
    assert sender.accept("c", 1, 0.0)
    assert sender.resumed(None) == 2
    assert sent(sender) == [Numbered(3, "c")]


def test_a_sender_without_memory_goes_on_where_the_receiver_is() -> None:
    sender = sender_with("a", "b", attached=False)
    assert sender.resumed(57) == 0
    assert [message.seq for message in sent(sender)] == [58, 59]


def test_what_is_kept_for_somebody_who_never_returns_is_lost() -> None:
    sender = sender_with("a", "b", "c")
    sent(sender)
    sender.delivered(1)
    assert sender.abandoned() == 2
    assert sender.unconfirmed == 0
    assert sender.abandoned() == 0


def test_numbers_wrap() -> None:
    sender = sender_with("a", "b", "c", attached=False)
    sender.resumed(SEQ_MODULUS - 2)
    assert [message.seq for message in sent(sender)] == [SEQ_MODULUS - 1, 0, 1]
    receiver = ResumeReceiver(SEQ_MODULUS - 2)
    assert receiver.arrived(SEQ_MODULUS - 1) == Arrival(is_new=True)
    assert receiver.arrived(1) == Arrival(is_new=True, lost=1)
    assert receiver.arrived(0) == Arrival(is_new=False)


def test_what_comes_twice_is_dropped_and_what_never_comes_is_counted() -> None:
    receiver = ResumeReceiver()
    assert receiver.arrived(1) == Arrival(is_new=True)
    assert receiver.arrived(1) == Arrival(is_new=False)
    assert receiver.arrived(5) == Arrival(is_new=True, lost=3)
    assert receiver.lost == 3


def test_the_highest_number_is_told_once() -> None:
    receiver = ResumeReceiver()
    assert receiver.untold() is None
    receiver.arrived(1)
    receiver.arrived(2)
    assert receiver.untold() == 2
    assert receiver.untold() is None


def test_a_gap_is_known_before_the_next_message() -> None:
    receiver = ResumeReceiver()
    receiver.arrived(1)
    assert receiver.announced(5) == 3
    assert receiver.arrived(5) == Arrival(is_new=True)
    assert receiver.announced(4) == 0


def test_nobody_knows_what_a_sender_without_memory_lost() -> None:
    receiver = ResumeReceiver()
    assert receiver.announced(None) == 0
    receiver.arrived(1)
    assert receiver.announced(None) is None


def test_who_listens_anew_misses_nothing_of_before() -> None:
    receiver = ResumeReceiver()
    receiver.arrived(1)
    receiver.renewed()
    assert receiver.untold() is None
    assert receiver.announced(40) == 0
    assert receiver.arrived(42) == Arrival(is_new=True, lost=2)
    receiver.renewed()
    assert receiver.arrived(90) == Arrival(is_new=True)


class World:
    """A sender and a receiver with a connection between them that comes and goes; everything on it is ordered."""

    def __init__(self, last: int, sender_speaks_first: bool) -> None:
        self.sender: ResumeSender[int] = ResumeSender(LIMITS)
        self.receiver = ResumeReceiver(last)
        self.sender_speaks_first = sender_speaks_first
        self.wire: deque[Numbered[int]] = deque()
        self.told: deque[int] = deque()
        self.accepted: list[int] = []
        self.arrived: list[int] = []
        self.now_s = 0.0
        self.connect()

    def connect(self) -> None:
        """Operators say at once what comes next; robots once they know what has arrived."""
        if self.sender.is_attached:
            return
        if self.sender_speaks_first:
            self.receiver.announced(self.sender.first_seq)
        assert self.receiver.received is not None
        self.sender.resumed(self.receiver.received)
        if not self.sender_speaks_first:
            self.receiver.announced(self.sender.first_seq)

    def half_connect(self) -> None:
        """The connection is lost again before the other side's word has arrived."""
        if not self.sender.is_attached:
            if self.sender_speaks_first:
                self.receiver.announced(self.sender.first_seq)
            else:
                self.sender.resumed(self.receiver.received)
            self.lose()

    def lose(self) -> None:
        self.wire.clear()
        self.told.clear()
        self.sender.detached()

    def send(self) -> None:
        item = len(self.accepted)
        if self.sender.accept(item, 1 + item % 20, self.now_s):
            self.accepted.append(item)

    def put(self) -> None:
        message = self.sender.upcoming()
        if message is not None:
            self.sender.went_out()
            self.wire.append(message)

    def deliver(self) -> None:
        if self.wire:
            message = self.wire.popleft()
            if self.receiver.arrived(message.seq).is_new:
                self.arrived.append(message.item)

    def tell(self) -> None:
        seq = self.receiver.untold()
        if seq is not None and self.sender.is_attached:
            self.told.append(seq)

    def hear(self) -> None:
        if self.told:
            self.sender.delivered(self.told.popleft())

    def wait(self) -> None:
        self.now_s += 6.0

    def step(self, name: str) -> None:
        getattr(self, name)()
        assert self.sender.unconfirmed <= LIMITS.messages + LIMITS.in_flight_messages
        assert self.sender.size_bytes <= LIMITS.size_bytes + LIMITS.in_flight_bytes


STEPS = st.sampled_from(
    ["send", "send", "put", "put", "deliver", "deliver", "tell", "hear", "lose", "connect", "half_connect", "wait"]
)
STARTS = st.sampled_from([(0, True), (0, False), (SEQ_MODULUS - 4, False)])


@settings(max_examples=400, deadline=None)
@given(st.lists(STEPS, max_size=120), STARTS)
def test_every_accepted_message_arrives_once_and_in_order_or_both_ends_count_it(
    steps: list[str], start: tuple[int, bool]
) -> None:
    world = World(*start)
    for step in steps:
        world.step(step)
    world.lose()
    world.connect()
    while world.sender.upcoming() is not None:
        world.put()
    while world.wire:
        world.deliver()
    assert world.arrived == sorted(set(world.arrived))
    assert len(world.arrived) + world.receiver.lost == len(world.accepted)
    assert world.sender.lost == world.receiver.lost
    assert world.sender.lost == 0 or "wait" in steps, "only what waited too long may be lost"
