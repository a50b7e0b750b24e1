"""TLS to a server by one of its addresses, verified for its name."""

from __future__ import annotations

import ssl
from typing import Any


class NamedTls(ssl.SSLContext):
    """A TLS context like that of ``ssl.create_default_context()``, which also reads ``SSL_CERT_FILE``; whatever name a
    connection is made under, the certificate must be for :attr:`name`. aioice has no other way to say so.
    """

    name: str

    @classmethod
    def of(cls, name: str) -> NamedTls:
        """Reads the machine's authorities, which takes some milliseconds."""
        made = cls(ssl.PROTOCOL_TLS_CLIENT)
        made.name = name
        made.load_default_certs()
        return made

    def wrap_bio(
        self,
        incoming: ssl.MemoryBIO,
        outgoing: ssl.MemoryBIO,
        server_side: bool = False,
        server_hostname: str | bytes | None = None,
        session: ssl.SSLSession | None = None,
    ) -> Any:
        """Both asyncio and uvloop make their TLS connections by this."""
        return super().wrap_bio(incoming, outgoing, server_side, self.name, session)
