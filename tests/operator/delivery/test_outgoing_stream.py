"""What a store sends: at once, after what waits, or kept until there is a connection again."""

from __future__ import annotations

from itertools import count

import pytest

from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.operator.delivery.outgoing_stream import OutgoingStream

NOW_US = 5_000_000


class RecordingPort:
    """An open channel that takes as many frames as it has ``room`` for."""

    def __init__(self, room: int = 1000) -> None:
        self.room = room
        self.has_arrived = True
        self.put_frames: list[tuple[int, bytes]] = []
        self.sent: list[bytes] = []
        self._numbers = count(1)

    def frame(self, kind: PayloadKind, payload: bytes) -> Frame:
        return Frame(kind, payload, seq=next(self._numbers), stamp_us=NOW_US)

    def put(self, frame: Frame) -> bool:
        if len(self.put_frames) >= self.room:
            return False
        self.put_frames.append((frame.seq, frame.payload))
        return True

    def send(self, kind: PayloadKind, payload: bytes) -> bool:
        if len(self.sent) >= self.room:
            return False
        self.sent.append(payload)
        return True


def stream(*, waits: bool = True) -> OutgoingStream:
    return OutgoingStream(lambda: NOW_US, waits=waits)


def said(outgoing: OutgoingStream, *payloads: bytes) -> list[bool]:
    return [outgoing.send(PayloadKind.JSON, payload) for payload in payloads]


@pytest.fixture
def live() -> tuple[OutgoingStream, RecordingPort]:
    """A stream whose robot knows how to go on where it was, on an open channel."""
    outgoing, port = stream(), RecordingPort()
    outgoing.attach(port)
    outgoing.resumed(0)
    return outgoing, port


def test_without_a_channel_it_keeps_what_may_wait_and_refuses_the_rest() -> None:
    assert said(stream(waits=True), b"a") == [True]
    assert said(stream(waits=False), b"a") == [False]


def test_until_the_robot_has_said_what_it_takes_part_in_messages_wait() -> None:
    outgoing, port = stream(waits=False), RecordingPort()
    outgoing.attach(port)
    assert said(outgoing, b"a", b"b") == [True, True]
    assert (port.put_frames, outgoing.waiting) == ([], 2)
    assert outgoing.resumed(0) == 0
    assert (port.put_frames, outgoing.waiting) == ([(1, b"a"), (2, b"b")], 0)


def test_on_a_live_channel_messages_go_out_at_once_under_their_own_numbers(
    live: tuple[OutgoingStream, RecordingPort],
) -> None:
    outgoing, port = live
    assert said(outgoing, b"a", b"b") == [True, True]
    assert port.put_frames == [(1, b"a"), (2, b"b")]


def test_a_full_channel_refuses_a_new_message_and_keeps_no_number_of_it(
    live: tuple[OutgoingStream, RecordingPort],
) -> None:
    outgoing, port = live
    port.room = 1
    assert said(outgoing, b"a", b"b") == [True, False]
    port.room = 2
    assert said(outgoing, b"c") == [True]
    assert port.put_frames == [(1, b"a"), (2, b"c")]


def test_a_new_message_does_not_overtake_what_waits(live: tuple[OutgoingStream, RecordingPort]) -> None:
    outgoing, port = live
    outgoing.lost()
    said(outgoing, b"a", b"b")
    port.room = 1
    outgoing.attach(port)
    outgoing.resumed(0)
    assert said(outgoing, b"c") == [True]
    assert port.put_frames == [(1, b"a")]
    port.room = 9
    outgoing.pump()
    assert [payload for _, payload in port.put_frames] == [b"a", b"b", b"c"]


def test_after_a_lost_connection_what_was_not_confirmed_goes_out_again_and_what_was_does_not(
    live: tuple[OutgoingStream, RecordingPort],
) -> None:
    outgoing, _ = live
    said(outgoing, b"a", b"b", b"c")
    outgoing.delivered(1)
    outgoing.lost()
    assert said(outgoing, b"d") == [True]
    assert (outgoing.waiting, outgoing.upcoming) == (3, 2)
    again = RecordingPort()
    outgoing.attach(again)
    assert again.put_frames == []  # until the robot has said how far it got
    assert outgoing.resumed(2) == 0
    assert again.put_frames == [(3, b"c"), (4, b"d")]


def test_a_robot_that_remembers_nothing_is_not_told_again_what_may_have_acted(
    live: tuple[OutgoingStream, RecordingPort],
) -> None:
    outgoing, _ = live
    said(outgoing, b"a", b"b")
    outgoing.lost()
    said(outgoing, b"c")
    again = RecordingPort()
    outgoing.attach(again)
    assert outgoing.resumed(None) == 2
    assert [payload for _, payload in again.put_frames] == [b"c"]


@pytest.mark.parametrize("is_open", [True, False])
def test_where_the_robot_does_not_number_what_waited_goes_out_once_under_the_channels_numbers(is_open: bool) -> None:
    outgoing, port = stream(), RecordingPort()
    said(outgoing, b"a", b"b")
    if is_open:
        outgoing.attach(port)
    assert outgoing.is_numbered
    assert outgoing.plain() == 0
    outgoing.attach(port)
    assert (port.sent, port.put_frames) == ([b"a", b"b"], [])
    assert not outgoing.is_numbered
    assert said(outgoing, b"c") == [True]
    assert port.sent == [b"a", b"b", b"c"]


def test_what_the_channel_refuses_leaves_when_it_has_drained_and_nothing_overtakes_it() -> None:
    outgoing, port = stream(), RecordingPort(room=1)
    said(outgoing, b"a", b"b")
    outgoing.attach(port)
    outgoing.plain()
    assert said(outgoing, b"c") == [True]
    assert (port.sent, outgoing.waiting) == ([b"a"], 2)
    port.room = 10
    outgoing.pump()
    assert (port.sent, outgoing.waiting) == ([b"a", b"b", b"c"], 0)


def test_where_the_robot_does_not_number_nothing_is_kept_while_the_channel_is_closed() -> None:
    outgoing, port = stream(), RecordingPort()
    outgoing.attach(port)
    outgoing.plain()
    outgoing.detach()
    assert said(outgoing, b"a") == [False]
    outgoing.attach(port)
    assert port.sent == []


def test_a_closed_stream_says_how_many_messages_may_not_have_arrived_and_takes_no_more(
    live: tuple[OutgoingStream, RecordingPort],
) -> None:
    outgoing, port = live
    said(outgoing, b"a", b"b", b"c")
    outgoing.delivered(2)
    assert outgoing.close() == 1
    assert said(outgoing, b"d") == [False]
    outgoing.attach(port)
    assert len(port.put_frames) == 3
    assert not outgoing.is_numbered


def test_a_store_that_is_gone_leaves_nothing_to_say(live: tuple[OutgoingStream, RecordingPort]) -> None:
    outgoing, _ = live
    outgoing.lost()
    said(outgoing, b"a")
    outgoing.released()
    again = RecordingPort()
    outgoing.attach(again)
    outgoing.resumed(0)
    assert again.put_frames == []


def test_a_stream_that_waits_is_bounded_also_by_empty_messages() -> None:
    outgoing = stream()
    accepted = 0
    while said(outgoing, b"") == [True]:
        accepted += 1
        assert accepted < 1_000_000
    assert accepted > 100
    assert outgoing.waiting == accepted


@pytest.mark.parametrize(("has_arrived", "lost"), [(True, 0), (False, 1)])
def test_at_a_good_bye_only_what_may_still_be_under_way_counts_as_lost(
    live: tuple[OutgoingStream, RecordingPort], has_arrived: bool, lost: int
) -> None:
    outgoing, port = live
    port.has_arrived = has_arrived
    said(outgoing, b"a")
    outgoing.leaving()
    assert outgoing.close() == lost


def test_at_a_good_bye_what_waits_counts_as_lost() -> None:
    outgoing = stream()
    said(outgoing, b"a")
    outgoing.leaving()
    assert outgoing.close() == 1
