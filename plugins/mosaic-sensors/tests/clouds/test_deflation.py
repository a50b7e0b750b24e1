"""Deflating is tried, measured, given up where it doesn't pay, and tried again now and then."""

from __future__ import annotations

from mosaic_sensors.point_cloud.deflation import LOOK_AGAIN, SENDING_S_PER_BYTE, Deflation

SIZE = 600_000
QUICK_S, SLOW_S = SIZE * SENDING_S_PER_BYTE / 20, SIZE * SENDING_S_PER_BYTE * 3


def told(deflation: Deflation, share: float, spent_s: float, times: int = 20) -> Deflation:
    for _ in range(times):
        deflation.note(SIZE, int(SIZE * share), spent_s)
    return deflation


def test_it_begins_with_a_try() -> None:
    assert Deflation().pays(SIZE)
    assert not Deflation().pays(0)


def test_it_goes_on_while_a_saved_byte_costs_less_than_a_sent_one() -> None:
    assert told(Deflation(), 0.3, QUICK_S).pays(SIZE)
    assert not told(Deflation(), 0.3, SLOW_S).pays(SIZE)
    assert not told(Deflation(), 0.99, QUICK_S).pays(SIZE)


def test_it_looks_again_after_a_while_and_learns() -> None:
    deflation = told(Deflation(), 1.0, QUICK_S)
    tries = [deflation.pays(SIZE) for _ in range(2 * LOOK_AGAIN)]
    assert tries.count(True) == 2
    assert told(deflation, 0.2, QUICK_S).pays(SIZE)


def test_never_and_always_are_obeyed() -> None:
    assert not Deflation("never").pays(SIZE)
    always = told(Deflation("always"), 1.2, SLOW_S)
    assert always.pays(SIZE)
    assert always.keeps(SIZE, SIZE + 10)
    assert not always.pays(0)


def test_a_try_that_saved_nothing_is_not_sent() -> None:
    assert Deflation().keeps(SIZE, SIZE // 2)
    assert not Deflation().keeps(SIZE, SIZE - 1)
