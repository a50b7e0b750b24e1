"""Access tokens of operators: JWTs signed with the server's secret, valid for twelve hours."""

from __future__ import annotations

import hmac
import time
from dataclasses import dataclass
from typing import Any

import jwt

from mosaic_core.machines.lan.pairing_proof import proof_of
from mosaic_core.words.codes import ResultCode

LIFETIME_S = 12 * 3600
_NEVER_S = 253_402_300_799
"""The last second of the year 9999."""
_ISSUER = "mosaic-server"


class AccessTokenRefused(Exception):
    """An access token is refused. ``code`` is what the original server answers for this kind of refusal."""

    def __init__(self, code: ResultCode) -> None:
        super().__init__(code.name)
        self.code = code


@dataclass(frozen=True, slots=True)
class AccessClaims:
    account_id: str
    login_version: int
    expires_at_s: int


class AccessTokens:
    """Makes and reads access tokens. Any thread."""

    def __init__(self, secret: bytes) -> None:
        self._secret = secret

    def make(
        self, account_id: str, organization_id: str, role: str, login_version: int, *, until_revoked: bool = False
    ) -> str:
        """``until_revoked``: for paired devices. A robot's clock may be wrong by years, so time ends nothing there."""
        now = int(time.time())
        claims = {
            "iss": _ISSUER,
            "iat": now,
            "exp": _NEVER_S if until_revoked else now + LIFETIME_S,
            "userId": account_id,
            "organizationPk": organization_id,
            "role": role,
            "ver": login_version,
        }
        return jwt.encode(claims, self._secret, algorithm="HS256")

    def proof(self, claims: str, nonce: str) -> str:
        """What only the server can answer that made a token of these claims, its first two parts: who keeps the token
        asks before it shows it."""
        return proof_of(hmac.digest(self._secret, claims.encode(), "sha256"), nonce)

    def read(self, token: str | None) -> AccessClaims:
        """Raises :class:`AccessTokenRefused`."""
        if not token:
            raise AccessTokenRefused(ResultCode.AUTHENTICATION_FAILED)
        try:
            claims: dict[str, Any] = jwt.decode(
                token,
                self._secret,
                algorithms=["HS256"],
                issuer=_ISSUER,
                # A clock that was set back must not sign everybody out: the time of issue protects nothing.
                options={"require": ["exp", "iat", "userId", "ver"], "verify_iat": False},
            )
            return AccessClaims(str(claims["userId"]), int(claims["ver"]), int(claims["exp"]))
        except jwt.ExpiredSignatureError as error:
            raise AccessTokenRefused(ResultCode.ACCESS_TOKEN_EXPIRED) from error
        except jwt.InvalidSignatureError as error:
            raise AccessTokenRefused(ResultCode.ACCESS_TOKEN_DECRYPTING_FAILED) from error
        except (jwt.InvalidTokenError, ValueError, TypeError) as error:
            raise AccessTokenRefused(ResultCode.ACCESS_TOKEN_NOT_EXIST) from error
