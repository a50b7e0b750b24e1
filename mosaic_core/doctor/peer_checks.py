"""A real peer connection, robot's half to operator's half: over this machine alone, then through the TURN servers."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass

from mosaic_core.adapters.diagnosis.peer_trial import TrialResult, peer_trial
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.finding import Finding, failed, passed, warned
from mosaic_core.words.ice import IceServer

WANTED_BPS = 20_000_000
"""Several cameras and a point cloud; this machine should not be what limits them."""
WANTED_PATH_BPS = 2_000_000
"""One camera."""
RELAY_TIMEOUT_S = 6.0


@dataclass(frozen=True, slots=True)
class Speed:
    """The speed of a path. ``is_least``: it may be faster, for the round trip held the trial back; ``way``: what of the
    path was measured."""

    throughput_bps: float
    round_trip_ms: float
    is_least: bool = False
    way: str = ""


async def loopback_checks() -> AsyncIterator[Finding]:
    """Whether WebRTC works here at all, and what the processor allows."""
    try:
        result = await peer_trial()
    except MosaicError as error:
        yield failed("webrtc.loopback", error.code, error.message, error.cure)
        return
    yield _works("webrtc.loopback", "within this machine", result)
    yield _fast("webrtc.throughput", "This machine's limit", result, WANTED_BPS)


async def relay_trial_checks(servers: Sequence[IceServer]) -> AsyncIterator[Finding]:
    """Both halves through TURN only, so that nothing but the relay is used."""
    try:
        result = await peer_trial(servers, relay_only=True, timeout_s=RELAY_TIMEOUT_S)
    except MosaicError as error:
        yield failed("relay.connection", error.code, f"Through TURN: {error.message}", error.cure)
        return
    yield _works("relay.connection", "through TURN", result)
    yield _fast("relay.throughput", "Through TURN, there and back", result, WANTED_PATH_BPS)


def _works(check: str, where: str, result: TrialResult) -> Finding:
    path = f", {result.path.summary()}" if result.path else ""
    facts = {"setupMs": round(result.setup_ms, 1), **({"path": result.path.facts()} if result.path else {})}
    text = f"A peer connection {where} works: {result.setup_ms:.0f} ms to an open channel{path}."
    return passed(check, text, **facts)


def _fast(check: str, what: str, result: TrialResult, wanted_bps: float) -> Finding:
    return speed_finding(check, what, Speed(result.throughput_bps, result.round_trip_ms), wanted_bps)


def speed_finding(check: str, what: str, speed: Speed, wanted_bps: float, cure: str = "") -> Finding:
    """``what`` is the path; ``cure`` where it is not this machine that is slow."""
    mbps = speed.throughput_bps / 1e6
    least = "at least " if speed.is_least else ""
    text = f"{what}: {least}{mbps:.{0 if mbps >= 10 else 1}f} Mbit/s, round trip {speed.round_trip_ms:.1f} ms."
    facts = {"bps": round(speed.throughput_bps), "roundTripMs": round(speed.round_trip_ms, 2)}
    if speed.throughput_bps < wanted_bps and not speed.is_least:
        return warned(check, "check.slow_path", text, cure, facts)
    return passed(check, text, **facts)
