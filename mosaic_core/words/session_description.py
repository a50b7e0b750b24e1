"""What can be read off a session description (SDP, RFC 8866) without understanding all of it."""

from __future__ import annotations


def is_media_only(sdp: str) -> bool:
    """It has lines for pictures or sound and none for data channels, so that it can carry none."""
    kinds = {line[2:].split(" ", 1)[0] for line in sdp.splitlines() if line.startswith("m=")}
    return bool(kinds) and "application" not in kinds


def fingerprints(sdp: str) -> frozenset[str]:
    """Of the certificates that it names: whose offers have the same ones are one and the same peer connection."""
    prefix = "a=fingerprint:"
    return frozenset(line.removeprefix(prefix).strip().lower() for line in sdp.splitlines() if line.startswith(prefix))
