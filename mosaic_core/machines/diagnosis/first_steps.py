"""Chooses what to do first about many findings: one cause often has several effects, and only the cause is worth a
step."""

from __future__ import annotations

from collections.abc import Sequence

from mosaic_core.words.finding import Finding

_EXPLAINS: dict[str, tuple[str, ...]] = {
    "config.yaml": ("server.", "ice.", "device."),
    "network.addresses": ("server.", "ice.", "webrtc.", "relay."),
    "server.dns": ("server.", "ice.servers"),
    "server.tcp": ("server.", "ice.servers"),
    "server.tls": ("server.", "ice.servers"),
    "server.clock": ("server.token", "ice.turn"),
    "server.http": ("server.websocket", "server.token", "ice.servers"),
    "server.token": ("ice.servers",),
    "ice.servers": ("ice.nat", "relay."),
    "ice.turn": ("ice.relay", "relay."),
    "ice.relay": ("relay.",),
}
"""A failed check, and the starts of those that fail with it. Earlier ones explain later ones, never the reverse."""
_RANKS = {check: rank for rank, check in enumerate(_EXPLAINS)}
MAX_STEPS = 3


def first_steps(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """The findings to act on, the most urgent first, at most :data:`MAX_STEPS`; empty where nothing is wrong."""
    bad = [one for one in findings if one.status == "fail"]
    causes = [one for one in bad if not _is_explained(one, bad)]
    warnings = [one for one in findings if one.status == "warn" and not _is_explained(one, bad)]
    return tuple([*causes, *warnings][:MAX_STEPS])


def _is_explained(finding: Finding, bad: Sequence[Finding]) -> bool:
    rank = _RANKS.get(finding.check, len(_RANKS))
    causes = [cause.check for cause in bad if _RANKS.get(cause.check, len(_RANKS)) < rank]
    return any(finding.check.startswith(_EXPLAINS[cause]) for cause in causes)
