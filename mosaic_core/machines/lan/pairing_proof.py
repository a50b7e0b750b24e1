"""Proves to a paired device that a server is the one that gave it its sign-in, without the sign-in being told.

A sign-in is a JWT: claims and, as its last part, their signature. The device sends the claims and a nonce; only who can
sign the claims can answer with the HMAC of the nonce. Whoever passes the question on to the robot and the answer back
passes for the robot, as whoever listens on plain http does: against those there is TLS.
"""

from __future__ import annotations

import base64
import binascii
import hmac

_PURPOSE = "mosaic pairing proof:"


def proof_of(signature: bytes, nonce: str) -> str:
    """The answer of who knows a token's signature."""
    return hmac.new(signature, (_PURPOSE + nonce).encode(), "sha256").hexdigest()


def claims_of(token: str) -> str:
    """What of a token may be told to anybody."""
    return token.rpartition(".")[0]


def is_proved(token: str, nonce: str, proof: str) -> bool:
    """Whether ``proof`` answers ``nonce`` for this token; a token that is none is never proved."""
    signature = token.rpartition(".")[2]
    try:
        key = base64.b64decode(signature + "=" * (-len(signature) % 4), altchars=b"-_", validate=True)
    except (binascii.Error, ValueError):
        return False
    return bool(key) and hmac.compare_digest(proof_of(key, nonce).encode(), proof.encode())
