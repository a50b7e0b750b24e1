"""The proof that a server gave a sign-in: of the signature and the nonce, and of nothing that is told."""

from __future__ import annotations

import hmac

import jwt
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.lan.pairing_proof import claims_of, is_proved, proof_of

SECRET = b"s" * 32


def answer(secret: bytes, claims: str, nonce: str) -> str:
    """As the server does."""
    return proof_of(hmac.digest(secret, claims.encode(), "sha256"), nonce)


@given(st.text(), st.text(min_size=1))
def test_who_signed_the_claims_proves_it_for_one_nonce(user: str, nonce: str) -> None:
    token = jwt.encode({"userId": user}, SECRET, algorithm="HS256")
    proof = answer(SECRET, claims_of(token), nonce)
    assert is_proved(token, nonce, proof)
    assert not is_proved(token, nonce + "x", proof)
    assert not is_proved(token, nonce, answer(b"o" * 32, claims_of(token), nonce))


def test_the_claims_hold_no_signature() -> None:
    assert claims_of("head.body.signature") == "head.body"


@given(st.text(), st.text(), st.text())
def test_nonsense_proves_nothing(token: str, nonce: str, proof: str) -> None:
    assert not is_proved(token, nonce, proof)


def test_a_token_without_a_signature_is_proved_by_nobody() -> None:
    assert not is_proved("head.body.", "nonce", proof_of(b"", "nonce"))
