"""Explains the error codes of STUN and TURN servers to whoever set them up (RFC 8489 §14.8, RFC 8656 §19)."""

from __future__ import annotations

_MEANINGS: dict[int, tuple[str, str]] = {
    300: ("ice.turn_failed", "it sends us to another server (300 Try Alternate), which isn't supported"),
    400: ("ice.turn_failed", "it does not understand the request (400 Bad Request)"),
    401: ("ice.turn_refused", "it refuses user name or password (401 Unauthorized)"),
    403: ("ice.turn_forbidden", "it forbids an allocation (403 Forbidden)"),
    420: ("ice.turn_failed", "it does not know an attribute that we need (420 Unknown Attribute)"),
    437: ("ice.turn_failed", "it still has an allocation of this port (437 Allocation Mismatch)"),
    438: ("ice.turn_refused", "its nonce is stale at once (438 Stale Nonce): several servers behind one address?"),
    440: ("ice.turn_failed", "it has no address of the wanted family (440 Address Family not Supported)"),
    441: ("ice.turn_refused", "it takes the credentials for others than those of the allocation (441)"),
    442: ("ice.turn_failed", "it does not relay UDP (442 Unsupported Transport Protocol)"),
    486: ("ice.turn_quota", "this account has as many allocations as it may (486 Allocation Quota Reached)"),
    500: ("ice.turn_failed", "it failed inside (500 Server Error)"),
    508: ("ice.turn_quota", "it has no relay port left (508 Insufficient Capacity)"),
}


def turn_refusal(error_code: int, phrase: str = "") -> tuple[str, str]:
    """The reason code, and what happened as the end of a sentence (``turn:host says: …``)."""
    known = _MEANINGS.get(error_code)
    if known is not None:
        return known
    return "ice.turn_failed", f"it answers with error {error_code}{f' ({phrase})' if phrase else ''}"
