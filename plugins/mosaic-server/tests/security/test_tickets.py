"""A ticket says who comes to which robot, is signed with the key that robots are told of, and soon runs out."""

from __future__ import annotations

import base64
import time
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from mosaic_core.words.signaling import OperatorIdentity
from mosaic_server.security.tickets import LIFETIME_S, TicketOffice

ANN = OperatorIdentity(id="ann", name="Ann", role="supervisor", program=True)


@pytest.fixture
def office() -> TicketOffice:
    return TicketOffice(Ed25519PrivateKey.generate())


def issued(office: TicketOffice) -> str:
    return office.issue(session_id="s1", robot_id="r1", peer_id="p1", operator=ANN)


def announced_key(office: TicketOffice) -> Ed25519PublicKey:
    padding = "=" * (-len(office.public_key.x) % 4)
    return Ed25519PublicKey.from_public_bytes(base64.urlsafe_b64decode(office.public_key.x + padding))


def claims(office: TicketOffice) -> dict[str, Any]:
    return jwt.decode(issued(office), announced_key(office), algorithms=["EdDSA"])


def test_it_names_the_operator_the_role_and_the_one_connection(office: TicketOffice) -> None:
    told = {name: value for name, value in claims(office).items() if name not in ("iat", "exp")}
    assert told == {
        "sessionId": "s1",
        "robotId": "r1",
        "peerId": "p1",
        "sub": "ann",
        "name": "Ann",
        "role": "supervisor",
        "program": True,
    }


def test_it_holds_for_five_minutes_from_now(office: TicketOffice) -> None:
    before_s = int(time.time())
    told = claims(office)
    assert before_s <= told["iat"] <= time.time()
    assert told["exp"] - told["iat"] == LIFETIME_S == 300


def test_its_header_names_the_announced_key_by_its_fingerprint(office: TicketOffice) -> None:
    header = jwt.get_unverified_header(issued(office))
    assert (header["alg"], header["kid"]) == ("EdDSA", office.public_key.kid)


def test_the_same_key_is_announced_alike_after_a_restart_and_another_one_differently() -> None:
    secret = Ed25519PrivateKey.from_private_bytes(bytes(32))
    key = TicketOffice(secret).public_key
    assert (key.kid, key.x) == ("139e3940e64b5491", "O2onvM62pC1io6jQKm8Nc2UyFXcd4kOmOsBIoYtZ2ik")
    assert TicketOffice(Ed25519PrivateKey.generate()).public_key.kid != key.kid
