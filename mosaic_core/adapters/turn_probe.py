"""Asks one TURN server, by one protocol, for an allocation, and gives it back."""

from __future__ import annotations

import asyncio
import socket
import ssl
import time
from dataclasses import dataclass

from aioice import stun, turn

from mosaic_core.adapters.name_lookup import address_of
from mosaic_core.machines.turn_answer import turn_refusal
from mosaic_core.words.ice import IceUrl

TIMEOUT_S = 5.0
FAREWELL_S = 1.0


@dataclass(frozen=True, slots=True)
class TurnAnswer:
    """``code`` is ``check.ok`` where an allocation was made, ``problem`` the end of a sentence about the server."""

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
    try:
        async with asyncio.timeout(timeout_s):
            relayed = await _allocated(url, username, credential)
        return TurnAnswer(str(url), "check.ok", _since_ms(began_s), relayed=relayed)
    except Exception as error:  # noqa: BLE001 - whatever answers at that port is foreign input
        code, problem = _cause(error, url, timeout_s, has_credentials=bool(username and credential))
        return TurnAnswer(str(url), code, _since_ms(began_s), problem)


async def _allocated(url: IceUrl, username: str | None, credential: str | None) -> str:
    is_secure = url.scheme == "turns"  # its certificate names the host: don't resolve it here
    host = url.host if is_secure else await address_of(url.host)
    transport, protocol = await turn.create_turn_endpoint(
        _Quiet, (host, url.port), username, credential, ssl=is_secure or None, transport=url.transport
    )
    address = transport.get_extra_info("sockname")
    transport.close()
    try:
        async with asyncio.timeout(FAREWELL_S):
            await protocol.lost.wait()
    except TimeoutError:
        pass  # the server frees it by itself after ten minutes
    return f"[{address[0]}]:{address[1]}" if ":" in address[0] else f"{address[0]}:{address[1]}"


class _Quiet(asyncio.DatagramProtocol):
    """Nobody sends through this allocation."""

    def __init__(self) -> None:
        self.lost = asyncio.Event()

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost.set()


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
            return "ice.turn_failed", f"its certificate can't be verified: {error.verify_message}"
        case ssl.SSLError():
            return "ice.turn_failed", f"it does not speak TLS as expected ({error.reason or error})"
        case _:
            return "ice.turn_failed", str(error) or type(error).__name__


def _since_ms(began_s: float) -> float:
    return (time.monotonic() - began_s) * 1000
