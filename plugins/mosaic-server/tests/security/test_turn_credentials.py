"""Credentials for TURN: what coturn reads, and nothing of the secret."""

from __future__ import annotations

import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.words.ice import IceServer
from mosaic_server.security.turn_credentials import MAX_LIFETIME_S, turn_credential
from mosaic_server.storage.ice_servers import StoredIceServer

SECRETS = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), min_size=8)


def test_a_credential_is_what_openssl_makes_of_it() -> None:
    # printf '1700000600:rover' | openssl dgst -sha1 -hmac north -binary | base64
    credential = turn_credential("north", "rover", 1_700_000_000.9)
    assert credential.username == "1700000600:rover"
    assert credential.password == "OXokPxew3l5T5E9aOCrVfo5yPv8="  # noqa: S105 - of nobody


@given(SECRETS, st.uuids().map(str), st.floats(0, 2**32), st.floats(1, MAX_LIFETIME_S))
def test_a_username_says_when_it_ends_and_whose_it_is(secret: str, party: str, now_s: float, lifetime_s: float) -> None:
    credential = turn_credential(secret, party, now_s, lifetime_s)
    ends_s, _, whose = credential.username.partition(":")
    assert now_s + lifetime_s - 1 < int(ends_s) <= now_s + MAX_LIFETIME_S
    assert whose == party
    assert len(base64.b64decode(credential.password, validate=True)) == 20


@given(SECRETS, SECRETS, st.uuids().map(str), st.floats(0, 2**32))
def test_another_secret_another_party_or_another_second_make_another_password(
    secret: str, other: str, party: str, now_s: float
) -> None:
    password = turn_credential(secret, party, now_s).password
    assert turn_credential(secret, party + "x", now_s).password != password
    assert turn_credential(secret, party, now_s + 1.5).password != password
    assert (turn_credential(other, party, now_s).password == password) == (other == secret)


@given(SECRETS, st.uuids().map(str))
def test_the_secret_is_not_in_what_is_handed_out_or_printed(secret: str, party: str) -> None:
    entry = StoredIceServer("id", IceServer(urls=("turn:turn.example.org",)), f"<{secret}>")
    issued = entry.issued(party, 1_700_000_000, MAX_LIFETIME_S)
    assert f"<{secret}>" not in str(issued.wire())
    assert f"<{secret}>" not in repr(entry)
    assert issued.credential is not None
    assert issued.credential not in repr(issued)


def test_an_entry_without_a_secret_is_handed_out_as_it_is() -> None:
    fixed = IceServer(urls=("turn:turn.example.org",), username="u", credential="c")
    assert StoredIceServer("id", fixed).issued("rover", 0, MAX_LIFETIME_S) == fixed


@pytest.mark.parametrize("lifetime_s", [0, -1, MAX_LIFETIME_S + 1, float("nan")])
def test_nobody_gets_credentials_that_live_too_long(lifetime_s: float) -> None:
    with pytest.raises(ValueError, match="up to 600 s"):
        turn_credential("north", "rover", 0, lifetime_s)


def test_an_empty_secret_makes_nothing() -> None:
    with pytest.raises(ValueError, match="empty"):
        turn_credential("", "rover", 0)
