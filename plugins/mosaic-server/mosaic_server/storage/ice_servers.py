"""Reading and writing the ICE servers that the server hands out."""

from __future__ import annotations

import json

from sqlalchemy import select
from sqlalchemy.orm import Session

from mosaic_core.words.ice import IceServer
from mosaic_server.storage.tables import IceServerRow


def add_ice_server(session: Session, server: IceServer) -> str:
    """Returns the new entry's id."""
    row = IceServerRow(urls=json.dumps(server.urls), username=server.username, credential=server.credential)
    session.add(row)
    session.flush()
    return row.id


def listed_ice_servers(session: Session) -> list[tuple[str, IceServer]]:
    """All entries with their ids, oldest first."""
    rows = session.scalars(select(IceServerRow).order_by(IceServerRow.created_at_ms, IceServerRow.id))
    return [
        (row.id, IceServer(urls=tuple(json.loads(row.urls)), username=row.username, credential=row.credential))
        for row in rows
    ]


def ice_servers(session: Session) -> tuple[IceServer, ...]:
    return tuple(server for _, server in listed_ice_servers(session))


def remove_ice_server(session: Session, ice_server_id: str) -> bool:
    """Whether there was such an entry."""
    row = session.get(IceServerRow, ice_server_id)
    if row is not None:
        session.delete(row)
    return row is not None
