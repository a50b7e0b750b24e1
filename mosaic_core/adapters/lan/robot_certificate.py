"""Looks at the certificate of a robot's own server before anything is told to it."""

from __future__ import annotations

import asyncio
import ssl
from urllib.parse import urlsplit

import httpx

from mosaic_core.words.errors import SignalingError

_TIMEOUT_S = 5.0
LARGEST_CERTIFICATE = 20_000
"""Letters of PEM; the usual ones have two thousand."""


async def certificate_to_pin(url: str) -> str:
    """The certificate that is presented at ``url``, as PEM; empty over http, and where an authority that this machine
    trusts vouches for it. Raises :class:`SignalingError` (``signal.unreachable``)."""
    if not url.startswith("https:"):
        return ""
    try:
        await _presented(url, httpx.create_ssl_context())
    except ssl.SSLCertVerificationError:
        certificate = ssl.DER_cert_to_PEM_cert(await _presented(url, _unverified()))
        if len(certificate) > LARGEST_CERTIFICATE:
            raise SignalingError(f"the certificate at {url} is too large", code="signal.bad_message") from None
        return certificate
    return ""


async def _presented(url: str, context: ssl.SSLContext) -> bytes:
    """The certificate as DER. Verification is the caller's, so its failure is passed on as it is."""
    parts = urlsplit(url)
    try:
        async with asyncio.timeout(_TIMEOUT_S):
            _, writer = await asyncio.open_connection(parts.hostname, parts.port or 443, ssl=context)
    except ssl.SSLCertVerificationError:
        raise
    except (OSError, TimeoutError) as error:
        why = str(error) or type(error).__name__
        raise SignalingError(f"{url} can't be reached: {why}", code="signal.unreachable") from error
    try:
        return writer.get_extra_info("ssl_object").getpeercert(binary_form=True) or b""
    finally:
        writer.transport.abort()


def _unverified() -> ssl.SSLContext:
    """Only to read a certificate: nothing is sent by it."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context
