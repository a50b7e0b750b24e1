"""Hashes passwords with argon2id, at the library's current cost unless the settings say another one."""

from __future__ import annotations

import secrets
from base64 import b64encode
from dataclasses import dataclass, field
from functools import lru_cache

from argon2 import (
    DEFAULT_MEMORY_COST,
    DEFAULT_PARALLELISM,
    DEFAULT_TIME_COST,
    PasswordHasher,
)
from argon2.exceptions import InvalidHashError, VerificationError
from argon2.low_level import ARGON2_VERSION

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
    """A hash that no password has, but by a chance that nobody lives to see: to check one costs as much as ever, and
    to draw it nothing, where a hash would cost each start of a server 0.2 s of a processor and an eighth of a small
    board's memory."""
    sizes = (hasher.salt_len, hasher.hash_len)
    salt, tag = (b64encode(secrets.token_bytes(size)).rstrip(b"=").decode() for size in sizes)
    cost = f"m={hasher.memory_cost},t={hasher.time_cost},p={hasher.parallelism}"
    return f"$argon2id$v={ARGON2_VERSION}${cost}${salt}${tag}"
