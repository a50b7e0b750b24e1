"""Hashes passwords with argon2id, at the library's current cost unless the settings say another one."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field
from functools import lru_cache

from argon2 import (
    DEFAULT_MEMORY_COST,
    DEFAULT_PARALLELISM,
    DEFAULT_TIME_COST,
    PasswordHasher,
)
from argon2.exceptions import InvalidHashError, VerificationError

MIN_PASSWORD_LENGTH = 8
MAX_PASSWORD_LENGTH = 1024
"""Longer ones only cost the hash's time."""


@dataclass(frozen=True, slots=True)
class HashingCost:
    """The cost of one hash for whoever checks or guesses a password: argon2's parameters, RFC 9106's second choice."""

    passes: int = DEFAULT_TIME_COST
    memory_kib: int = DEFAULT_MEMORY_COST
    lanes: int = DEFAULT_PARALLELISM


@dataclass(frozen=True, slots=True)
class HashedPassword:
    """The hash that is kept of a password. Where a server runs, its hashing line makes it before a transaction
    begins."""

    text: str = field(repr=False)


_hasher = PasswordHasher()


def hash_at(cost: HashingCost) -> None:
    """Hash at this cost from now on, in the whole process; kept hashes are renewed as their owners log in."""
    global _hasher
    _hasher = PasswordHasher(cost.passes, cost.memory_kib, cost.lanes)
    _hash_of_nobody(_hasher)  # now, or the first attempt at an unknown account would take twice as long


def new_password() -> str:
    """A generated password: 96 random bits."""
    return secrets.token_urlsafe(12)


def hash_password(password: str) -> str:
    if not MIN_PASSWORD_LENGTH <= len(password) <= MAX_PASSWORD_LENGTH:
        raise ValueError(f"a password has {MIN_PASSWORD_LENGTH} to {MAX_PASSWORD_LENGTH} characters")
    return _hasher.hash(password)


def hashed(password: str | HashedPassword) -> HashedPassword:
    """Raises ``ValueError`` for one that is too short or too long."""
    return password if isinstance(password, HashedPassword) else HashedPassword(hash_password(password))


def nobodys_password() -> HashedPassword:
    """Of an account that nobody logs in to by password; it costs no hashing."""
    return HashedPassword(_hash_of_nobody(_hasher))


def check_password(stored: str | None, password: str) -> str | None:
    """The hash to keep from now on if the password is right (renewed if parameters changed), else ``None``.

    ``stored=None`` means an unknown account; it costs the same time, so that nobody can find out who exists.
    """
    hasher = _hasher
    try:
        hasher.verify(stored or _hash_of_nobody(hasher), password[: MAX_PASSWORD_LENGTH + 1])
    except (VerificationError, InvalidHashError):
        return None
    if stored is None:
        return None
    return hasher.hash(password) if hasher.check_needs_rehash(stored) else stored


@lru_cache(maxsize=1)
def _hash_of_nobody(hasher: PasswordHasher) -> str:
    return hasher.hash(secrets.token_urlsafe())
