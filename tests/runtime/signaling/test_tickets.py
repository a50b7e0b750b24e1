"""Only a ticket of the robot's own server, for this robot and this connection, lets an operator in."""

from __future__ import annotations

import base64
import time
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from mosaic_core.runtime.signaling.tickets import LEEWAY_S, TicketVerifier
from mosaic_core.words.errors import AuthError
from mosaic_core.words.signaling import PrepareConnection, TicketKey

SECRET = Ed25519PrivateKey.generate()
PREPARED = PrepareConnection(rtc_connection_id="p1", session_id="s1")


def key(secret: Ed25519PrivateKey = SECRET, kid: str = "k1") -> TicketKey:
    raw = secret.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw)
    return TicketKey(kid=kid, x=base64.urlsafe_b64encode(raw).decode().rstrip("="))


def ticket(secret: Ed25519PrivateKey = SECRET, kid: str | None = "k1", **changes: Any) -> str:
    now = time.time()
    claims = {
        "sessionId": "s1", "robotId": "r1", "peerId": "p1", "sub": "ann", "name": "Ann", "role": "supervisor",
        "iat": now, "exp": now + 60, **changes,
    }  # fmt: skip
    kept = {name: value for name, value in claims.items() if value is not None}
    return jwt.encode(kept, secret, algorithm="EdDSA", headers={"kid": kid} if kid else None)


def verify(text: str, *keys: TicketKey) -> Any:
    return TicketVerifier("r1")(text, PREPARED, keys or (key(),))


def test_a_good_ticket_says_who_the_operator_is() -> None:
    who = verify(ticket())
    assert (who.session_id, who.operator_id, who.name, who.role) == ("s1", "ann", "Ann", "supervisor")


def test_the_server_says_who_is_a_program() -> None:
    assert verify(ticket(program=True), key()).is_program
    assert not verify(ticket(), key()).is_program
    assert not verify(ticket(program="yes"), key()).is_program


def test_the_key_is_chosen_by_its_id_so_that_servers_can_rotate() -> None:
    assert verify(ticket(), key(Ed25519PrivateKey.generate(), "k0"), key()).operator_id == "ann"


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"exp": 1.0}, "expired"),
        ({"iat": 4e9}, "clock"),
        ({"robotId": "r2"}, "another robotId"),
        ({"peerId": "p2"}, "another peerId"),
        ({"sessionId": "s2"}, "another sessionId"),
        ({"role": "god"}, "unknown role"),
        *(({name: None}, name) for name in ("exp", "iat", "sub", "sessionId", "robotId", "peerId", "role")),
    ],
)
def test_every_wrong_claim_is_refused_by_name(changes: dict[str, Any], part: str) -> None:
    with pytest.raises(AuthError, match=part) as caught:
        verify(ticket(**changes))
    assert caught.value.code == "auth.bad_ticket"


def test_clocks_may_differ_by_a_minute() -> None:
    now = time.time()
    for changes in ({"exp": now - LEEWAY_S + 20}, {"iat": now + LEEWAY_S - 20}):
        assert verify(ticket(**changes)).operator_id == "ann"
    for changes in ({"exp": now - LEEWAY_S - 20}, {"iat": now + LEEWAY_S + 20}):
        with pytest.raises(AuthError, match="clock"):
            verify(ticket(**changes))


def test_ids_are_the_same_in_capitals_and_a_nameless_operator_has_no_name() -> None:
    who = verify(ticket(robotId="R1", peerId="P1", sessionId="S1", name=None))
    assert (who.session_id, who.name) == ("S1", "")


def test_a_server_that_names_no_session_leaves_it_to_the_ticket() -> None:
    prepared = PrepareConnection(rtc_connection_id="p1")
    assert TicketVerifier("r1")(ticket(sessionId="s9"), prepared, (key(),)).session_id == "s9"


def test_an_unknown_role_and_an_unknown_key_are_told() -> None:
    with pytest.raises(AuthError, match="unknown role 'god'"):
        verify(ticket(role="god"))
    with pytest.raises(AuthError, match="a key that the server did not announce"):
        verify(ticket(kid="k9"))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a.b.c",
        ticket(Ed25519PrivateKey.generate()),
        ticket(kid=None),
        ticket(kid="k9"),
        jwt.encode({"sub": "ann"}, "x" * 32, algorithm="HS256", headers={"kid": "k1"}),
        jwt.encode({"sub": "ann"}, "", algorithm="none", headers={"kid": "k1"}),
    ],
)
def test_what_our_server_did_not_sign_is_refused(text: str) -> None:
    with pytest.raises(AuthError) as caught:
        verify(text)
    assert caught.value.code == "auth.bad_ticket"


def test_an_unusable_key_refuses_instead_of_crashing() -> None:
    for x in ("", "AAAA", "?"):
        with pytest.raises(AuthError, match="unusable key") as caught:
            verify(ticket(), TicketKey(kid="k1", x=x))
        assert caught.value.code == "auth.bad_ticket"
