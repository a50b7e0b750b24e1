"""Passwords are kept as argon2id hashes with the library's current parameters."""

from __future__ import annotations

import secrets

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

MIN_PASSWORD_LENGTH = 8
MAX_PASSWORD_LENGTH = 1024
"""Longer ones only cost the hash's time."""

_hasher = PasswordHasher()
_NOBODY = _hasher.hash(secrets.token_urlsafe())


def new_password() -> str:
    """A generated password: 96 random bits."""
    return secrets.token_urlsafe(12)


def hash_password(password: str) -> str:
    if not MIN_PASSWORD_LENGTH <= len(password) <= MAX_PASSWORD_LENGTH:
        raise ValueError(f"a password has {MIN_PASSWORD_LENGTH} to {MAX_PASSWORD_LENGTH} characters")
    return _hasher.hash(password)


def check_password(stored: str | None, password: str) -> str | None:
    """The hash to keep from now on if the password is right (renewed if parameters changed), else ``None``.

    ``stored=None`` means an unknown account; it costs the same time, so that nobody can find out who exists.
    """
    try:
        _hasher.verify(stored or _NOBODY, password[: MAX_PASSWORD_LENGTH + 1])
    except (VerificationError, InvalidHashError):
        return None
    if stored is None:
        return None
    return _hasher.hash(password) if _hasher.check_needs_rehash(stored) else stored
