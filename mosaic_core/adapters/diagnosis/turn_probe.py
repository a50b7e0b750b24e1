"""Asks one TURN server, by one protocol, for an allocation, and gives it back."""

from __future__ import annotations

import asyncio
import socket
import ssl
import time
from dataclasses import dataclass
from typing import TypeAlias

from aioice import stun, turn

from mosaic_core.adapters.signaling.address_race import first_address
from mosaic_core.adapters.signaling.name_lookup import addresses_of
from mosaic_core.adapters.signaling.named_tls import NamedTls
from mosaic_core.machines.diagnosis.turn_answer import turn_refusal
from mosaic_core.words.ice import IceUrl

TIMEOUT_S = 5.0
FAREWELL_S = 1.0


@dataclass(frozen=True, slots=True)
class TurnAnswer:
    """What a TURN server answered to a request for an allocation. ``code`` is ``check.ok`` where an allocation was
    made, ``problem`` the end of a sentence about the server.
    """

    url: str
    code: str
    took_ms: float
    problem: str = ""
    relayed: str = ""


async def turn_probe(
    url: IceUrl, username: str | None, credential: str | None, timeout_s: float = TIMEOUT_S
) -> TurnAnswer:
    """Never raises; takes ``timeout_s`` at most, and a moment to say good-bye."""
    began_s = time.monotonic()
    tls = NamedTls.of(url.host) if url.scheme == "turns" else None

    async def allocated(address: str) -> _ProbedAllocation:
        return await turn.create_turn_endpoint(
            _Quiet, (address, url.port), username, credential, ssl=tls, transport=url.transport
        )

    try:
        allocation = await first_address(addresses_of(url.host), allocated, timeout_s, _given_back)
        took_ms, relayed = _since_ms(began_s), _shown(allocation)
        await _given_back(allocation)
        return TurnAnswer(str(url), "check.ok", took_ms, relayed=relayed)
    except Exception as error:  # noqa: BLE001 - whatever answers at that port is foreign input
        code, problem = _cause(error, url, timeout_s, has_credentials=bool(username and credential))
        return TurnAnswer(str(url), code, _since_ms(began_s), problem)


def _shown(allocation: _ProbedAllocation) -> str:
    host, port = allocation[0].get_extra_info("sockname")
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


async def _given_back(allocation: _ProbedAllocation) -> None:
    transport, protocol = allocation
    transport.close()
    try:
        async with asyncio.timeout(FAREWELL_S):
            await protocol.lost.wait()
    except TimeoutError:
        pass  # the server frees it by itself after ten minutes


class _Quiet(asyncio.DatagramProtocol):
    """The receiver of an allocation through which nobody sends."""

    def __init__(self) -> None:
        self.lost = asyncio.Event()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()


_ProbedAllocation: TypeAlias = tuple[turn.TurnTransport, _Quiet]


def _cause(error: Exception, url: IceUrl, timeout_s: float, *, has_credentials: bool) -> tuple[str, str]:
    match error:
        case stun.TransactionFailed(response=response):
            code, phrase = response.attributes.get("ERROR-CODE", (0, ""))
            if code == 401 and not has_credentials:
                return "ice.turn_no_credentials", "it wants user name and password, and none are configured"
            return turn_refusal(code, phrase)
        case TimeoutError() | stun.TransactionTimeout():
            return "ice.turn_silent", f"no answer within {timeout_s:.0f} s"
        case socket.gaierror():
            return "ice.turn_silent", "its name can't be resolved"
        case ConnectionRefusedError():
            return "ice.turn_silent", f"nothing listens at {url.transport.upper()} port {url.port}"
        case ssl.SSLCertVerificationError():
            return "ice.turn_tls", f"its certificate can't be verified: {error.verify_message}"
        case ssl.SSLError():
            return "ice.turn_tls", f"it does not speak TLS as expected ({error.reason or error})"
        case ConnectionError() if url.scheme == "turns":
            return "ice.turn_tls", "it hangs up where TLS begins"
        case _:
            return "ice.turn_failed", str(error) or type(error).__name__


def _since_ms(began_s: float) -> float:
    return (time.monotonic() - began_s) * 1000
