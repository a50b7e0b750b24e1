"""Looks whether a certificate and a key can be used, before a server begins with them."""

from __future__ import annotations

import ssl
from pathlib import Path


def tls_mistake(certificate: Path, key: Path) -> str:
    """What is wrong with the two PEM files; empty if nothing is."""
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    except (ssl.SSLError, OSError) as error:
        return f"{certificate} and {key} are no certificate and its key: {error}"
    return ""
