"""PINs and codes: once, in time, and not by guessing. Pure."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_server.security.pairing import (
    PIN_DIGITS,
    WRONG_PINS,
    WRONG_PINS_PER_OFFER,
    Offer,
    PinLimits,
    hash_of,
    new_secrets,
    typed_pin,
    with_code,
    with_pin,
)

ONE = Offer("1", hash_of("11111111"), hash_of("code-1"), 0)
TWO = Offer("2", hash_of("22222222"), hash_of("code-2"), 3)
VOID = Offer("3", None, hash_of("code-3"), 5)


def test_a_pin_meets_its_offer_and_counts_against_none() -> None:
    verdict = with_pin([ONE, TWO, VOID], "22222222")
    assert (verdict.accepted, verdict.wrong_pins) == ("2", {})


def test_a_wrong_pin_counts_against_every_offer_and_makes_void_what_has_had_enough() -> None:
    verdict = with_pin([ONE, Offer("2", TWO.pin_hash, TWO.code_hash, WRONG_PINS_PER_OFFER - 1)], "33333333")
    assert verdict.accepted is None
    assert verdict.wrong_pins == {"1": 1, "2": WRONG_PINS_PER_OFFER}
    assert not verdict.is_void("1")
    assert verdict.is_void("2")


def test_a_void_pin_opens_nothing_and_its_code_still_does() -> None:
    assert with_pin([VOID], "").accepted is None
    assert with_code([ONE, VOID], "code-3").accepted == "3"


def test_a_code_is_never_counted_for_it_can_not_be_guessed() -> None:
    verdict = with_code([ONE, TWO], "code-9")
    assert (verdict.accepted, verdict.wrong_pins) == (None, {})


def test_without_an_offer_nothing_is_accepted_or_counted() -> None:
    for verdict in (with_pin([], "11111111"), with_code([], "code-1")):
        assert (verdict.accepted, verdict.wrong_pins) == (None, {})


@given(st.text(max_size=30))
def test_pins_are_read_as_people_write_them(text: str) -> None:
    digits = typed_pin(text)
    assert all(letter in "0123456789" for letter in digits)
    assert typed_pin(f"{digits[:4]} {digits[4:]}") == digits


@given(st.data())
def test_secrets_are_whole_and_never_the_same(data: st.DataObject) -> None:
    shown = new_secrets()
    assert len(shown.pin) == PIN_DIGITS
    assert shown.pin.isdigit()
    assert len(shown.code) == 16
    assert new_secrets().code != shown.code


@given(st.lists(st.floats(0, 10_000), max_size=60).map(sorted), st.floats(0, 20_000))
def test_beyond_the_limit_of_all_addresses_pins_wait_and_never_longer_than_its_window(
    failures: list[float], later_s: float
) -> None:
    limits = PinLimits()
    for at_s in failures:
        limits.failed(at_s)
    now_s = (failures[-1] if failures else 0.0) + later_s
    recent = [at_s for at_s in failures if at_s > now_s - WRONG_PINS.window_s]
    wait_s = limits.wait_s(now_s)
    assert (wait_s > 0) == (len(recent) >= WRONG_PINS.failures)
    assert wait_s <= WRONG_PINS.window_s
