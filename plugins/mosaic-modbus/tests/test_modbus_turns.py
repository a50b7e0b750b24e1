"""Who may use the line next."""

from __future__ import annotations

import threading

from mosaic_modbus.turns import Turns


def test_what_is_urgent_goes_before_all_that_waits() -> None:
    turns, order = Turns(), []
    waiting: list[threading.Thread] = []

    def ask(name: str, *, urgently: bool) -> None:
        with turns.taken(urgently=urgently):
            order.append(name)

    with turns.taken():
        for name, urgently in (("read", False), ("read again", False), ("stop", True)):
            waiting.append(threading.Thread(target=ask, args=(name,), kwargs={"urgently": urgently}))
            waiting[-1].start()
        while turns.waiting < 3:
            pass
    for one in waiting:
        one.join(10)
    assert order[0] == "stop"
    assert sorted(order) == ["read", "read again", "stop"]


def test_a_request_that_fails_leaves_the_line_to_the_next() -> None:
    turns = Turns()
    try:
        with turns.taken():
            raise OSError
    except OSError:
        pass
    with turns.taken(urgently=True), threading.Lock():
        assert turns.waiting == 0
