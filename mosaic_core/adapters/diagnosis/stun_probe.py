"""Asks STUN servers how they see this machine, all from one socket, so that their answers can be compared."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from aioice import stun

from mosaic_core.adapters.signaling.address_race import first_address
from mosaic_core.adapters.signaling.name_lookup import ipv4_addresses
from mosaic_core.machines.diagnosis.nat_kind import Mapping
from mosaic_core.words.ice import IceUrl

TIMEOUT_S = 4.0
"""Four questions are on their way by then (RFC 8489 §6.2.1: after 0, 0.5, 1.5 and 3.5 s)."""


@dataclass(frozen=True, slots=True)
class StunAnswer:
    """The answer of one STUN server; ``mapping`` is ``None`` if it said nothing of use, and ``problem`` says why."""

    url: str
    mapping: Mapping | None
    took_ms: float
    problem: str = ""


@dataclass(frozen=True, slots=True)
class StunSurvey:
    """All answers that one socket got."""

    local_port: int
    answers: tuple[StunAnswer, ...]
    more: tuple[Mapping, ...] = ()
    """How the servers' second addresses see the socket (RFC 5780), where they have one."""

    @property
    def mappings(self) -> list[Mapping]:
        return [*(one.mapping for one in self.answers if one.mapping is not None), *self.more]


class _Asker(asyncio.DatagramProtocol):
    """A socket with STUN transactions on it."""

    def __init__(self) -> None:
        self._transactions: dict[bytes, stun.Transaction] = {}
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)  # uvloop's and asyncio's share no base class

    def datagram_received(self, data: bytes, addr: Any) -> None:
        try:
            message = stun.parse_message(data)
        except ValueError:
            return
        transaction = self._transactions.get(message.transaction_id)
        if transaction is not None:
            transaction.response_received(message, (addr[0], addr[1]))

    def error_received(self, exc: Exception) -> None:
        """ICMP's word for one server says nothing about the others; who hears nothing times out."""

    def send_stun(self, message: stun.Message, addr: tuple[str, int]) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(bytes(message), addr)

    async def ask(self, server: tuple[str, int]) -> stun.Message:
        request = stun.Message(message_method=stun.Method.BINDING, message_class=stun.Class.REQUEST)
        transaction = stun.Transaction(request, server, self)
        self._transactions[request.transaction_id] = transaction
        try:
            response, _ = await transaction.run()
        finally:
            del self._transactions[request.transaction_id]
        return response


async def stun_survey(urls: Sequence[IceUrl], timeout_s: float = TIMEOUT_S) -> StunSurvey:
    """Ask them all at once over IPv4. TURN servers answer as well. Never raises; takes ``timeout_s`` at most."""
    loop = asyncio.get_running_loop()
    transport, asker = await loop.create_datagram_endpoint(_Asker, local_addr=("0.0.0.0", 0))  # noqa: S104 - as ICE
    try:
        port = int(transport.get_extra_info("sockname")[1])
        asked = await asyncio.gather(*(_asked(asker, url, timeout_s) for url in urls))
        more = tuple(mapping for _, mappings in asked for mapping in mappings)
        return StunSurvey(port, tuple(answer for answer, _ in asked), more)
    finally:
        transport.close()


async def _asked(asker: _Asker, url: IceUrl, timeout_s: float) -> tuple[StunAnswer, list[Mapping]]:
    began_s, more, mapping, problem = time.monotonic(), list[Mapping](), None, ""
    try:
        async with asyncio.timeout(timeout_s):
            server, response, took_ms = await _first_word(asker, url, timeout_s)
            mapping = Mapping(server, _mapped(response))
            other = response.attributes.get("OTHER-ADDRESS")
            if other is not None and other[0] != server[0]:
                more.append(Mapping(tuple(other), _mapped(await asker.ask(tuple(other)))))
            return StunAnswer(str(url), mapping, took_ms), more
    except (TimeoutError, stun.TransactionTimeout):
        problem = f"no answer within {timeout_s:.0f} s"
    except stun.TransactionError as error:
        problem = str(error)
    except socket.gaierror:
        problem = "its name can't be resolved"
    except (OSError, KeyError, ValueError) as error:
        problem = str(error) or type(error).__name__
    took_ms = (time.monotonic() - began_s) * 1000
    return StunAnswer(str(url), mapping, took_ms, "" if mapping is not None else problem), more


async def _first_word(asker: _Asker, url: IceUrl, timeout_s: float) -> tuple[tuple[str, int], stun.Message, float]:
    """Which of its addresses answered, what, and after how many milliseconds."""

    async def asked(address: str) -> tuple[tuple[str, int], stun.Message, float]:
        server, began_s = (address, url.port), time.monotonic()
        return server, await asker.ask(server), (time.monotonic() - began_s) * 1000

    return await first_address(ipv4_addresses(url.host), asked, timeout_s)


def _mapped(response: stun.Message) -> tuple[str, int]:
    found = response.attributes.get("XOR-MAPPED-ADDRESS") or response.attributes["MAPPED-ADDRESS"]
    return str(found[0]), int(found[1])
