"""Hashes of passwords: who is not here is checked as long as who is, and never let in."""

from __future__ import annotations

from argon2 import extract_parameters

from mosaic_server.security.passwords import check_password, hash_password, nobodys_password

PASSWORD = "correct horse battery"  # noqa: S105 - of nobody


def test_the_right_password_is_known_by_its_hash_and_a_wrong_one_is_not() -> None:
    stored = hash_password(PASSWORD)
    assert check_password(stored, PASSWORD) == stored
    assert check_password(stored, PASSWORD + "!") is None
    assert stored != hash_password(PASSWORD), "salted"


def test_an_unknown_account_is_checked_at_the_cost_of_a_known_one_and_has_no_password() -> None:
    nobodys = nobodys_password().text
    assert extract_parameters(nobodys) == extract_parameters(hash_password(PASSWORD))
    for stored in (None, nobodys):
        assert check_password(stored, PASSWORD) is None
        assert check_password(stored, "") is None
