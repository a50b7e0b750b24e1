"""Credentials for TURN that end by themselves: the TURN server shares a secret with us and needs no list of accounts.

The scheme is coturn's ``use-auth-secret`` (draft-uberti-behave-turn-rest-00 §2.2).
"""

from __future__ import annotations

import base64
import hashlib
import hmac
from dataclasses import dataclass, field

MAX_LIFETIME_S = 600.0
"""Whoever finds a credential can relay with it until it ends. A relayed connection that was made goes on by itself."""


@dataclass(frozen=True, slots=True)
class TurnCredential:
    username: str
    password: str = field(repr=False)


def turn_credential(secret: str, party_id: str, now_s: float, lifetime_s: float = MAX_LIFETIME_S) -> TurnCredential:
    """One for a robot or account, valid until ``now_s`` (Unix time, s) + ``lifetime_s``.

    The id stays the same for one party: by it the TURN server counts who uses how much (``user-quota``).
    """
    if not secret:
        raise ValueError("the secret shared with the TURN server is empty")
    if not 0 < lifetime_s <= MAX_LIFETIME_S:
        raise ValueError(f"TURN credentials live for more than 0 and up to {MAX_LIFETIME_S:.0f} s, not {lifetime_s}")
    username = f"{int(now_s + lifetime_s)}:{party_id}"
    digest = hmac.new(secret.encode(), username.encode(), hashlib.sha1).digest()  # coturn knows no other hash here
    return TurnCredential(username, base64.b64encode(digest).decode())
