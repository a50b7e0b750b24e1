"""Checks an operator's ticket: an EdDSA JWT signed by the robot's server, for this robot and this connection."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Sequence
from typing import Any, get_args

import jwt
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

from mosaic_core.machines.signaling.peer_admission import PeerIdentity
from mosaic_core.words.control import Role
from mosaic_core.words.errors import AuthError
from mosaic_core.words.plain_text import plain
from mosaic_core.words.signaling import PrepareConnection, TicketKey

LEEWAY_S = 60
"""Robots without a battery-backed clock drift; a ticket names one connection and is used once, so a minute is safe."""
ROLES: tuple[Role, ...] = get_args(Role)


class TicketVerifier:
    """Verifies the tickets of operators for one robot; called as ``(ticket, prepared, keys)``."""

    def __init__(self, robot_id: str) -> None:
        self._robot_id = robot_id

    def __call__(self, ticket: str, prepared: PrepareConnection, keys: Sequence[TicketKey]) -> PeerIdentity:
        """Who the operator is; raises :class:`AuthError` (``auth.bad_ticket``) that says what is wrong."""
        claims = self._claims(ticket, keys)
        expected = {"robotId": self._robot_id, "peerId": prepared.rtc_connection_id}
        if prepared.session_id is not None:
            expected["sessionId"] = prepared.session_id
        for name, value in expected.items():
            if str(claims[name]).lower() != value.lower():
                raise _bad(f"the ticket is for another {name}")
        role = next((known for known in ROLES if known == claims["role"]), None)
        if role is None:
            raise _bad(f"the ticket names an unknown role {str(claims['role'])!r}")
        return PeerIdentity(
            str(claims["sessionId"]),
            str(claims["sub"]),
            plain(str(claims.get("name", ""))),
            role,
            is_program=claims.get("program") is True,
        )

    @staticmethod
    def _claims(ticket: str, keys: Sequence[TicketKey]) -> dict[str, Any]:
        required = ["exp", "iat", "sub", "sessionId", "robotId", "peerId", "role"]
        try:
            kid = jwt.get_unverified_header(ticket).get("kid")
            key = next((key for key in keys if key.kid == kid), None)
            if key is None:
                raise _bad("the ticket is signed with a key that the server did not announce")
            claims: dict[str, Any] = jwt.decode(
                ticket, _public_key(key), algorithms=["EdDSA"], leeway=LEEWAY_S, options={"require": required}
            )
        except jwt.ExpiredSignatureError:
            raise _bad("the ticket has expired; if this repeats, the robot's clock is wrong") from None
        except jwt.ImmatureSignatureError:
            raise _bad("the ticket is from the future: the robot's clock is wrong") from None
        except jwt.PyJWTError as error:
            raise _bad(f"the ticket is not valid: {error}") from None
        return claims


def _public_key(key: TicketKey) -> Ed25519PublicKey:
    try:
        raw = base64.urlsafe_b64decode(key.x + "=" * (-len(key.x) % 4))
        return Ed25519PublicKey.from_public_bytes(raw)
    except (ValueError, binascii.Error, UnsupportedAlgorithm):
        raise _bad("the server announced an unusable key") from None


def _bad(message: str) -> AuthError:
    return AuthError(message, code="auth.bad_ticket")
