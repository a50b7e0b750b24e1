"""Robot tokens: 256 random bits, shown once, kept as their SHA-256."""

from __future__ import annotations

import hashlib
import hmac
import secrets

_PREFIX = "mrt_"
"""Lets people and secret scanners recognise a robot token."""


def new_robot_token() -> str:
    return _PREFIX + secrets.token_urlsafe(32)


def hash_of_token(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


def token_matches(stored_hash: str | None, token: str | None) -> bool:
    """Compared in constant time; a robot without a token in the database matches nothing."""
    if stored_hash is None or not token:
        return False
    return hmac.compare_digest(stored_hash, hash_of_token(token))
