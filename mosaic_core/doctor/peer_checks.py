"""A real peer connection, robot's half to operator's half: over this machine alone, then through the TURN servers."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence

from mosaic_core.adapters.peer_trial import TrialResult, peer_trial
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.finding import Finding, failed, passed, warned
from mosaic_core.words.ice import IceServer

WANTED_BPS = 20_000_000
"""Several cameras and a point cloud; this machine should not be what limits them."""
WANTED_RELAY_BPS = 2_000_000
"""One camera."""
RELAY_TIMEOUT_S = 6.0


async def loopback_checks() -> AsyncIterator[Finding]:
    """Whether WebRTC works here at all, and what the processor allows."""
    try:
        result = await peer_trial()
    except MosaicError as error:
        yield failed("webrtc.loopback", error.code, error.message, error.cure)
        return
    yield passed("webrtc.loopback", f"A peer connection within this machine works: {_shown(result)}.", **_facts(result))
    yield _speed("webrtc.throughput", "This machine's limit", result, WANTED_BPS)


async def relay_trial_checks(servers: Sequence[IceServer]) -> AsyncIterator[Finding]:
    """Both halves through TURN only, so that nothing but the relay is used."""
    try:
        result = await peer_trial(servers, relay_only=True, timeout_s=RELAY_TIMEOUT_S)
    except MosaicError as error:
        yield failed("relay.connection", error.code, f"Through TURN: {error.message}", error.cure)
        return
    yield passed("relay.connection", f"A peer connection through TURN works: {_shown(result)}.", **_facts(result))
    yield _speed("relay.throughput", "Through TURN, there and back", result, WANTED_RELAY_BPS)


def _speed(check: str, what: str, result: TrialResult, wanted_bps: float) -> Finding:
    text = f"{what}: {result.throughput_bps / 1e6:.0f} Mbit/s, round trip {result.round_trip_ms:.1f} ms."
    facts = {"bps": round(result.throughput_bps), "roundTripMs": round(result.round_trip_ms, 2)}
    if result.throughput_bps < wanted_bps:
        return warned(check, "check.slow_path", text, facts=facts)
    return passed(check, text, **facts)


def _shown(result: TrialResult) -> str:
    path = f", {result.path.summary()}" if result.path else ""
    return f"{result.setup_ms:.0f} ms to an open channel{path}"


def _facts(result: TrialResult) -> dict[str, object]:
    return {"setupMs": round(result.setup_ms, 1), **({"path": result.path.facts()} if result.path else {})}
