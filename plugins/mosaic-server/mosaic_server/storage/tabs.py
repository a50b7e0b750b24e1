"""Reading and writing the tabs of original dashboards, which belong to an organization. Every function runs inside one
transaction on a worker thread, and none sees a tab of another organization."""

from __future__ import annotations

from dataclasses import dataclass

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from mosaic_server.ids import is_uuid
from mosaic_server.storage.organizations import hold_organization
from mosaic_server.storage.tables import Tab

MOST_TABS = 100
"""Of one organization."""


class TooManyTabs(Exception):
    """The organization has as many tabs as it may."""


@dataclass(frozen=True, slots=True)
class TabRecord:
    """A tab as the rest of the server sees it; ``tab_config`` is the JSON text that a dashboard stored."""

    id: str
    name: str
    tab_config: str


def tabs_of(session: Session, organization_id: str) -> list[tuple[str, str]]:
    """(id, name) of each tab, oldest first."""
    mine = select(Tab.id, Tab.name).where(Tab.organization_id == organization_id)
    return [(row.id, row.name) for row in session.execute(mine.order_by(Tab.created_at_ms, Tab.id))]


def tab_of(session: Session, organization_id: str, tab_id: str) -> TabRecord | None:
    tab = _tab(session, organization_id, tab_id)
    return None if tab is None else TabRecord(tab.id, tab.name, tab.tab_config)


def add_tab(session: Session, organization_id: str, name: str) -> str:
    """The id of a new, empty tab; raises :class:`TooManyTabs`."""
    hold_organization(session, organization_id)
    count = session.scalar(select(func.count()).select_from(Tab).where(Tab.organization_id == organization_id)) or 0
    if count >= MOST_TABS:
        raise TooManyTabs
    tab = Tab(organization_id=organization_id, name=name)
    session.add(tab)
    session.flush()
    return tab.id


def change_tab(
    session: Session, organization_id: str, tab_id: str, *, name: str | None = None, tab_config: str | None = None
) -> bool:
    """What isn't given stays. False: there is no such tab."""
    tab = _tab(session, organization_id, tab_id)
    if tab is None:
        return False
    tab.name = tab.name if name is None else name
    tab.tab_config = tab.tab_config if tab_config is None else tab_config
    return True


def remove_tab(session: Session, organization_id: str, tab_id: str) -> bool:
    """False: there is no such tab."""
    tab = _tab(session, organization_id, tab_id)
    if tab is not None:
        session.delete(tab)
    return tab is not None


def _tab(session: Session, organization_id: str, tab_id: str) -> Tab | None:
    tab = session.get(Tab, tab_id.lower()) if is_uuid(tab_id) else None
    return tab if tab is not None and tab.organization_id == organization_id else None
