"""What waits for a receiver, and what it reads from the bytes."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from mosaic_core import DataChannelByteReceivable, DataChannelReceivable, DataChannelStringReceivable, Message, Sender
from mosaic_core.contract.handler import DataChannelJsonReceivable, Refused
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.machines.delivery.send_scheduler import QueueLimits
from mosaic_core.runtime.commands.inbox import Inbox, Incoming
from mosaic_core.runtime.commands.payload import PayloadReader
from mosaic_core.runtime.handlers.receiver import _takes_sender


def item(payload: bytes, peer_id: str = "p1") -> Incoming:
    return Incoming("a", payload, Sender(peer_id, "s"), 1, 0.0)


def test_latest_keeps_one_slot_per_sender_so_that_nobody_is_starved() -> None:
    inbox = Inbox(newest_only=True)
    for payload, peer_id in ((b"1", "p1"), (b"2", "p2"), (b"3", "p1")):
        assert inbox.put(item(payload, peer_id))
    assert inbox.waiting()[0] == 2
    assert [taken.payload for taken in (inbox.take(), inbox.take()) if taken] == [b"3", b"2"]
    assert inbox.take() is None
    assert inbox.replaced == 1


def test_nobody_has_paused_and_nothing_is_a_question_unless_it_is_said() -> None:
    it = item(b"1")
    assert (it.has_paused, it.request_id, it.request) == (False, None, 0)


def test_a_queue_is_bounded_and_ordered() -> None:
    inbox = Inbox(newest_only=False, limits=QueueLimits(messages=256, size_bytes=2000))
    accepted = [inbox.put(item(str(number).encode())) for number in range(257)]
    assert accepted == [True] * 256 + [False]
    first = inbox.take()
    assert first is not None
    assert first.payload == b"0"


def test_a_queue_whose_newest_wins_loses_its_oldest() -> None:
    inbox = Inbox(newest_only=False, limits=QueueLimits(messages=2, size_bytes=2000, newest_wins=True))
    assert all(inbox.put(item(str(number).encode())) for number in range(5))
    assert (inbox.waiting(), inbox.replaced) == ((2, 2), 3)
    assert [taken.payload for taken in (inbox.take(), inbox.take()) if taken] == [b"3", b"4"]


def test_what_a_departed_peer_still_wanted_is_forgotten() -> None:
    for newest_only in (True, False):
        inbox = Inbox(newest_only=newest_only)
        inbox.put(item(b"1", "p1"))
        inbox.put(item(b"2", "p2"))
        inbox.forget("p1")
        left = inbox.take()
        assert left is not None
        assert left.payload == b"2"
        assert inbox.take() is None


@pytest.mark.parametrize(("newest_only", "left"), [(True, [b"2"]), (False, [b"1", b"2"])])
def test_what_comes_while_it_is_held_waits_as_long_as_it_is(newest_only: bool, left: list[bytes]) -> None:
    inbox = Inbox(newest_only=newest_only)
    inbox.hold()
    inbox.put(item(b"1"))
    inbox.put(item(b"2"))
    assert inbox.take() is None
    assert inbox.wait(0.01) is None
    inbox.resume()
    assert [taken.payload for _ in left if (taken := inbox.wait(2)) is not None] == left
    assert inbox.take() is None


def test_resume_wakes_the_waiting_thread() -> None:
    inbox, got = Inbox(newest_only=False), []
    inbox.hold()
    inbox.put(item(b"1"))
    thread = threading.Thread(target=lambda: got.append(inbox.wait()))
    thread.start()
    inbox.resume()
    thread.join(20)
    assert [taken.payload for taken in got] == [b"1"]


def test_close_wakes_the_waiting_thread() -> None:
    inbox, got = Inbox(newest_only=False), []
    thread = threading.Thread(target=lambda: got.append(inbox.wait()))
    thread.start()
    inbox.close()
    thread.join(2)
    assert got == [None]


class Speed(Message):
    v: float
    extra: dict[str, Any] = {}  # noqa: RUF012


class Typed(DataChannelReceivable[Speed]):
    pass


class Turn(Message):
    by_deg: float = 0.0


class Whatever(Message, extra="allow"):
    pass


class AskedToDrive(RequestHandler[Speed | Whatever, str]):
    def answer(self, question: Speed | Whatever, request: Request) -> str:
        return ""


class Asked(RequestHandler[Whatever | Turn, str]):
    def answer(self, question: Whatever | Turn, request: Request) -> str:
        return ""


def test_a_question_may_say_whatever_one_of_its_models_keeps() -> None:
    read = PayloadReader(Asked("a")).read
    assert read(b'{"by_deg": 1.5}') == Turn(by_deg=1.5)
    assert read(b'{"w": 1}') == Whatever(w=1)
    read = PayloadReader(AskedToDrive("a")).read
    assert read(b'{"w": 1}') == Whatever(w=1)
    assert read(b'{"v": 1}') == Speed(v=1)


def test_a_typed_receiver_gets_its_message() -> None:
    assert PayloadReader(Typed("a")).read(b'{"v": "1.5", "unknown": 1}') == Speed(v=1.5)


def test_escaped_characters_are_characters() -> None:
    read = PayloadReader(DataChannelJsonReceivable("a")).read
    assert read(b'{"v": "\\u00e4\\ud83d\\ude00", "w": "\\\\ud800"}') == {"v": "\u00e4\U0001f600", "w": "\\ud800"}


def test_plain_receivers_get_dict_text_and_bytes() -> None:
    assert PayloadReader(DataChannelJsonReceivable("a")).read(b'{"v": 1}') == {"v": 1}
    assert PayloadReader(DataChannelStringReceivable("a")).read("ä".encode()) == "ä"
    assert PayloadReader(DataChannelByteReceivable("a")).read(b"\xff") == b"\xff"


@pytest.mark.parametrize(
    ("payload", "code"),
    [
        (b'{"v": NaN}', "safety.not_finite"),
        (b'{"v": 1, "extra": {"deep": [{"x": -Infinity}]}}', "safety.not_finite"),
        (b'{"v": 1e400}', "safety.not_finite"),
        (b'{"v": "nan"}', "channel.invalid"),
        (b'{"v": "fast"}', "channel.invalid"),
        (b"{}", "channel.invalid"),
        (b"[" * 100_000, "channel.invalid"),
        (b"\xff", "channel.invalid"),
        (b"", "channel.invalid"),
        (b'{"v": 1, "extra": {"\\ud800": 1}}', "channel.invalid"),
        (b'{"v": 1, "extra": {"a": ["\\uDFFF"]}}', "channel.invalid"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_code(payload: bytes, code: str) -> None:
    with pytest.raises(Refused) as caught:
        PayloadReader(Typed("a")).read(payload)
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b"{}", "v: Field required"),
        (b'{"x": 1}', "v: Field required; no field 'x'"),
        (b'{"V": 1}', "v: Field required; no field 'V': did you mean 'v'?"),
        (b'{"v": "fast", "x": 1}', "v: Input should be a valid number, unable to parse string as a number"),
        (b'{"' + b"x" * 999 + b'": 1}', f"v: Field required; no field '{'x' * 40}'"),
    ],
)
def test_a_missing_field_is_told_with_the_key_that_stands_instead(payload: bytes, message: str) -> None:
    with pytest.raises(Refused) as caught:
        PayloadReader(Typed("a")).read(payload)
    assert caught.value.message == message


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b'{"v": ' + b"1" * 5000 + b"}", "a whole number of too many digits"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"v": 1, "extra": "\\ud800"}', "half a surrogate pair"),
        (b"{", "not JSON"),
    ],
)
def test_a_refusal_says_what_is_wrong_with_the_text(payload: bytes, message: str) -> None:
    with pytest.raises(Refused, match=f"^{message}$"):
        PayloadReader(Typed("a")).read(payload)


@pytest.mark.parametrize("payload", [b"[3]", b'"hello"', b"5", b"null"])
def test_what_is_no_object_is_told_what_one_has(payload: bytes) -> None:
    with pytest.raises(Refused, match=r"^a JSON object is wanted, with the fields v, extra$"):
        PayloadReader(Typed("a")).read(payload)


@pytest.mark.parametrize("number", ["NaN", "-Infinity", "1e400"])
def test_a_number_that_is_not_finite_is_named(number: str) -> None:
    with pytest.raises(Refused, match=f"^{number} is not a finite number$"):
        PayloadReader(Typed("a")).read(f'{{"v": {number}}}'.encode())


def test_a_refusal_names_the_field_and_quotes_nothing() -> None:
    with pytest.raises(Refused, match="v: ") as caught:
        PayloadReader(Typed("a")).read(b'{"v": "my password"}')
    assert "password" not in str(caught.value)


def test_handle_data_may_be_written_with_or_without_its_sender() -> None:
    class Without(DataChannelJsonReceivable):
        def handle_data(self, data: dict[str, Any]) -> None:
            return

    class With(DataChannelJsonReceivable):
        def handle_data(self, data: dict[str, Any], sender: Sender) -> None:
            return

    class Whatever(DataChannelJsonReceivable):
        def handle_data(self, *arguments: Any) -> None:
            return

    assert [_takes_sender(made("a")) for made in (Without, With, Whatever)] == [False, True, True]
