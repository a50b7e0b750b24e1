"""Reading and writing the ICE servers that the server hands out. A TURN server's shared secret never leaves this side:
what is handed out is a credential made with it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from sqlalchemy import select
from sqlalchemy.orm import Session

from mosaic_core.words.ice import IceServer
from mosaic_server.security.turn_credentials import turn_credential
from mosaic_server.storage.tables import IceServerRow


@dataclass(frozen=True, slots=True)
class StoredIceServer:
    """An entry; with ``secret`` everybody gets credentials of their own, which end soon."""

    id: str
    server: IceServer
    secret: str | None = field(default=None, repr=False)

    @property
    def lacks_credentials(self) -> bool:
        """Nobody can use its TURN URLs, and a browser that is given them connects to no robot at all."""
        return self.secret is None and self.server.lacks_credentials

    def issued(self, party_id: str, now_s: float, lifetime_s: float) -> IceServer | None:
        """What ``party_id`` (a robot or an account) is told, if anything. ``now_s`` is Unix time."""
        if self.lacks_credentials:
            usable = tuple(url for url in self.server.urls if url.startswith("stun"))
            return IceServer(urls=usable) if usable else None
        if self.secret is None:
            return self.server
        credential = turn_credential(self.secret, party_id, now_s, lifetime_s)
        return IceServer(urls=self.server.urls, username=credential.username, credential=credential.password)


def add_ice_server(session: Session, server: IceServer, secret: str | None = None) -> str:
    """Returns the new entry's id. ``secret`` is the TURN server's ``static-auth-secret``."""
    row = IceServerRow(
        urls=json.dumps(server.urls), username=server.username, credential=server.credential, secret=secret
    )
    session.add(row)
    session.flush()
    return row.id


def listed_ice_servers(session: Session) -> list[StoredIceServer]:
    """All entries, oldest first."""
    rows = session.scalars(select(IceServerRow).order_by(IceServerRow.created_at_ms, IceServerRow.id))
    return [
        StoredIceServer(
            row.id,
            IceServer(urls=tuple(json.loads(row.urls)), username=row.username, credential=row.credential),
            row.secret,
        )
        for row in rows
    ]


def remove_ice_server(session: Session, ice_server_id: str) -> bool:
    """Whether there was such an entry."""
    row = session.get(IceServerRow, ice_server_id)
    if row is not None:
        session.delete(row)
    return row is not None
