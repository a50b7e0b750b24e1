"""Tickets: what the server vouches for when it introduces an operator to a robot, signed with Ed25519 (RFC 8037).

The robot knows the public key from ``session.welcome`` and can check a ticket without asking anybody.
"""

from __future__ import annotations

import base64
import hashlib
import time

import jwt
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from mosaic_core.words.signaling import OperatorIdentity, TicketKey

LIFETIME_S = 300
"""A ticket is presented within seconds; the rest is for robots whose clock is a little off."""


class TicketOffice:
    """Signs tickets. Any thread."""

    def __init__(self, key: Ed25519PrivateKey) -> None:
        self._key = key
        raw = key.public_key().public_bytes_raw()
        self.public_key = TicketKey(
            kid=hashlib.sha256(raw).hexdigest()[:16], x=base64.urlsafe_b64encode(raw).rstrip(b"=").decode()
        )

    def issue(self, *, session_id: str, robot_id: str, peer_id: str, operator: OperatorIdentity) -> str:
        """``operator`` with the role on this very robot; ``program``: the account can never pass for a person."""
        now = int(time.time())
        claims = {
            "sessionId": session_id,
            "robotId": robot_id,
            "peerId": peer_id,
            "sub": operator.id,
            "name": operator.name,
            "role": operator.role,
            "program": operator.program,
            "iat": now,
            "exp": now + LIFETIME_S,
        }
        return jwt.encode(claims, self._key, algorithm="EdDSA", headers={"kid": self.public_key.kid})
