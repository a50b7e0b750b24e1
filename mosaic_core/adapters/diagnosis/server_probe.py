"""The way to a server step by step: name, TCP, TLS. Each step raises what went wrong, with the code of that step."""

from __future__ import annotations

import asyncio
import ssl
import time
from dataclasses import dataclass
from typing import Any

from mosaic_core.adapters.signaling.name_lookup import addresses_of
from mosaic_core.words.errors import SignalingError

STEP_TIMEOUT_S = 4.0


@dataclass(frozen=True, slots=True)
class Certificate:
    """The server's certificate, verified for its name."""

    not_after_s: float
    """Seconds since the epoch."""
    issuer: str


async def resolved(host: str) -> str:
    """The first address; raises :class:`SignalingError` (``signal.name_unknown``)."""
    try:
        async with asyncio.timeout(STEP_TIMEOUT_S):
            return (await addresses_of(host))[0]
    except TimeoutError:
        message = f"The name server does not tell an address for {host} within {STEP_TIMEOUT_S:.0f} s."
        raise SignalingError(message, code="signal.name_unknown") from None
    except OSError as error:
        raise SignalingError(
            f"{host} has no address: {error.strerror or error}.", code="signal.name_unknown"
        ) from error


async def reached(host: str, port: int) -> float:
    """Open and close a TCP connection: milliseconds. Raises :class:`SignalingError` (``signal.unreachable``)."""
    began_s = time.monotonic()
    try:
        async with asyncio.timeout(STEP_TIMEOUT_S):
            _, writer = await asyncio.open_connection(host, port)
    except TimeoutError:
        text = f"{host}:{port} does not answer within {STEP_TIMEOUT_S:.0f} s."
        raise SignalingError(text, code="signal.unreachable", cure="Check the port and the firewalls.") from None
    except ConnectionRefusedError as error:
        cure = "Is the server running, and is the port right?"
        raise SignalingError(f"Nothing listens at {host}:{port}.", code="signal.unreachable", cure=cure) from error
    except OSError as error:
        raise SignalingError(
            f"{host}:{port} can't be reached: {error.strerror or error}.", code="signal.unreachable"
        ) from error
    took_ms = (time.monotonic() - began_s) * 1000
    writer.close()
    return took_ms


async def secured(host: str, port: int) -> Certificate:
    """Make a TLS connection, verified as robots do; raises :class:`SignalingError` (``signal.tls``)."""
    try:
        async with asyncio.timeout(STEP_TIMEOUT_S):
            _, writer = await asyncio.open_connection(host, port, ssl=ssl.create_default_context())
    except ssl.SSLCertVerificationError as error:
        text = f"The certificate of {host} can't be verified: {error.verify_message}."
        raise SignalingError(text, code="signal.tls") from error
    except ssl.SSLError as error:
        text, cure = f"{host}:{port} does not speak TLS ({error.reason or error}).", "Should the URL be ws://?"
        raise SignalingError(text, code="signal.tls", cure=cure) from error
    except (TimeoutError, OSError) as error:
        text = f"{host}:{port} broke off while TLS was set up ({error or 'no answer'})."
        raise SignalingError(text, code="signal.tls", cure="Should the URL be ws://?") from error
    told: dict[str, Any] = writer.get_extra_info("peercert") or {}
    writer.close()
    issuer = {key: value for part in told.get("issuer", ()) for key, value in part}
    name = str(issuer.get("organizationName") or issuer.get("commonName") or "unknown")
    return Certificate(ssl.cert_time_to_seconds(str(told["notAfter"])), name)
