"""The server's own keys, made once and kept in its database."""

from __future__ import annotations

import secrets

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from sqlalchemy import select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from mosaic_server.storage.tables import ServerKey


def access_token_secret(session: Session) -> bytes:
    """256 random bits that sign access tokens (HS256, RFC 7518 §3.2)."""
    return _kept(session, "access-token", secrets.token_bytes(32))


def ticket_key(session: Session) -> Ed25519PrivateKey:
    """The key that signs tickets."""
    fresh = Ed25519PrivateKey.generate().private_bytes_raw()
    return Ed25519PrivateKey.from_private_bytes(_kept(session, "ticket", fresh))


def _kept(session: Session, purpose: str, fresh: bytes) -> bytes:
    """The stored key, or ``fresh`` if there was none; two servers that start at once agree on one."""
    wanted = select(ServerKey.secret).where(ServerKey.purpose == purpose)
    stored = session.scalar(wanted)
    if stored is not None:
        return stored
    try:
        with session.begin_nested():
            session.add(ServerKey(purpose=purpose, secret=fresh))
    except IntegrityError:
        return session.scalars(wanted).one()
    return fresh
