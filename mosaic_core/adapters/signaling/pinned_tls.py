"""TLS to a server that is known by its certificate instead of by an authority."""

from __future__ import annotations

import ssl
from pathlib import Path


def pinned_tls(certificate: Path | str) -> ssl.SSLContext:
    """Trusts the very certificate of a PEM file, or of PEM text, whatever name it is for, and no other."""
    is_text = isinstance(certificate, str)
    context = ssl.create_default_context(
        cafile=None if is_text else str(certificate), cadata=str(certificate) if is_text else None
    )
    context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN  # it need not be an authority's
    context.check_hostname = False
    return context
