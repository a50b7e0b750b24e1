"""What pairs: a PIN as people type it, a code, or the address that holds it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.lan.pairing_secret import pairing_secret
from mosaic_core.words.errors import AuthError


@pytest.mark.parametrize("typed", ["12345678", "1234 5678", " 1234-5678\n", "1 2 3 4 5 6 7 8"])
def test_a_pin_is_read_as_it_is_shown_or_typed(typed: str) -> None:
    assert pairing_secret(typed) == {"pin": "12345678"}


@pytest.mark.parametrize("typed", ["Zv-JLF9Ly_SeUfAQ", "http://10.0.0.7:9002/#pair=Zv-JLF9Ly_SeUfAQ\n"])
def test_a_code_comes_alone_or_in_its_address(typed: str) -> None:
    assert pairing_secret(typed) == {"code": "Zv-JLF9Ly_SeUfAQ"}


def test_a_number_is_told_to_be_written_as_text() -> None:
    with pytest.raises(
        AuthError, match=r'the PIN is no text but a number, .* Write it in quotes: pin="012345"\.'
    ) as refused:
        pairing_secret(12345)  # type: ignore[arg-type]
    assert refused.value.code == "auth.pairing"


@given(st.text())
def test_whatever_is_typed_is_one_of_both(typed: str) -> None:
    [(kind, secret)] = pairing_secret(typed).items()
    assert kind == "code" or (secret.isascii() and (secret.isdigit() or not secret))
