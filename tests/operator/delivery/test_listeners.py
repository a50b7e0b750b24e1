"""Who wants to hear of something hears of it until it ends that, whatever the others do meanwhile."""

from __future__ import annotations

import asyncio

import pytest

from mosaic_core.operator.delivery.listeners import Listeners, first_heard


def test_everybody_hears_in_the_order_of_coming_until_they_leave() -> None:
    listeners, heard = Listeners[[str]](), list[str]()
    end_first = listeners.add(lambda word: heard.append(f"first {word}"))
    listeners.add(lambda word: heard.append(f"second {word}"))
    listeners.tell("one")
    end_first()
    end_first()
    listeners.tell("two")
    assert heard == ["first one", "second one", "second two"]
    assert len(listeners) == 1


def test_who_leaves_while_being_called_takes_the_word_from_nobody() -> None:
    listeners, heard = Listeners[[str]](), list[str]()
    end = listeners.add(lambda word: end())
    listeners.add(heard.append)
    listeners.tell("one")
    assert (heard, len(listeners)) == (["one"], 1)


async def test_the_first_value_is_waited_for_and_what_follows_is_not_heard() -> None:
    listeners = Listeners[[str]]()
    waiting = asyncio.create_task(first_heard(listeners.add))
    await asyncio.sleep(0)
    listeners.tell("one")
    listeners.tell("two")
    assert await waiting == "one"
    assert len(listeners) == 0


async def test_who_waits_no_longer_leaves_no_listener_behind() -> None:
    listeners = Listeners[[str]]()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await first_heard(listeners.add)
    assert len(listeners) == 0


def test_a_callback_that_fails_takes_the_word_from_nobody_and_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    def broken(word: str) -> None:
        raise ValueError(f"no {word}")

    listeners, heard = Listeners[[str]](), list[str]()
    listeners.add(broken)
    listeners.add(heard.append)
    listeners.tell("one")
    listeners.tell("two")
    assert heard == ["one", "two"]
    (record,) = caplog.records
    assert "broken failed (1 so far)" in record.message
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "no one"


def test_a_callback_that_nobody_would_await_is_refused() -> None:
    async def later(word: str) -> None:
        """Never."""

    with pytest.raises(TypeError, match=r"later is called without being awaited: write `def`, and start a task"):
        Listeners[[str]]().add(later)
