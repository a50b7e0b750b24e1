"""Reading and writing occupancy maps with their files, which belong to an organization. Every function runs inside one
transaction on a worker thread, and none sees a map of another organization."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from mosaic_server.ids import is_uuid
from mosaic_server.occupancy_map_files import MapFile
from mosaic_server.storage.organizations import hold_organization
from mosaic_server.storage.tables import OccupancyMap

MOST_MAPS = 100
MOST_BYTES = 256 * 1024 * 1024
"""Of one organization, all its maps together."""


class TooManyMaps(Exception):
    """The organization has as many maps, or as large ones, as it may."""


@dataclass(frozen=True, slots=True)
class MapRecord:
    """A map as the rest of the server sees it, without its files."""

    id: str
    name: str
    pgm_name: str
    yaml_name: str
    created_at_ms: int
    updated_at_ms: int


def maps_of(session: Session, organization_id: str, skip: int, limit: int) -> tuple[list[MapRecord], int]:
    """One page of the organization's maps, oldest first, and how many there are in all."""
    mine = OccupancyMap.organization_id == organization_id
    page = select(OccupancyMap).where(mine).order_by(OccupancyMap.created_at_ms, OccupancyMap.id)
    count = session.scalar(select(func.count()).select_from(OccupancyMap).where(mine)) or 0
    return [_record(one) for one in session.scalars(page.offset(skip).limit(limit))], count


def map_of(session: Session, organization_id: str, map_id: str) -> MapRecord | None:
    found = _map(session, organization_id, map_id)
    return None if found is None else _record(found)


def map_files_of(session: Session, organization_id: str, map_id: str) -> tuple[MapFile, MapFile] | None:
    """The picture and its description."""
    found = _map(session, organization_id, map_id)
    return None if found is None else (MapFile(found.pgm_name, found.pgm), MapFile(found.yaml_name, found.yaml))


def add_map(session: Session, organization_id: str, name: str, pgm: MapFile, yaml: MapFile) -> str:
    """The id of the new map; raises :class:`TooManyMaps`. The files were checked before."""
    hold_organization(session, organization_id)
    count, kept_bytes = _kept(session, organization_id)
    if count >= MOST_MAPS or kept_bytes + len(pgm.content) + len(yaml.content) > MOST_BYTES:
        raise TooManyMaps
    made = OccupancyMap(
        organization_id=organization_id,
        name=name,
        pgm_name=pgm.name,
        yaml_name=yaml.name,
        pgm=pgm.content,
        yaml=yaml.content,
    )
    session.add(made)
    session.flush()
    return made.id


def remove_map(session: Session, organization_id: str, map_id: str) -> bool:
    """False: there is no such map."""
    found = _map(session, organization_id, map_id)
    if found is not None:
        session.delete(found)
    return found is not None


def _kept(session: Session, organization_id: str) -> tuple[int, int]:
    """How many maps, and how many bytes of files."""
    mine = OccupancyMap.organization_id == organization_id
    count = session.scalar(select(func.count()).select_from(OccupancyMap).where(mine))
    size_bytes = func.sum(func.length(OccupancyMap.pgm) + func.length(OccupancyMap.yaml))
    return count or 0, session.scalar(select(size_bytes).where(mine)) or 0


def _map(session: Session, organization_id: str, map_id: str) -> OccupancyMap | None:
    found = session.get(OccupancyMap, map_id.lower()) if is_uuid(map_id) else None
    return found if found is not None and found.organization_id == organization_id else None


def _record(one: OccupancyMap) -> MapRecord:
    return MapRecord(one.id, one.name, one.pgm_name, one.yaml_name, one.created_at_ms, one.updated_at_ms)
