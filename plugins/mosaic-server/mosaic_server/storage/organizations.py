"""Making an organization with everything that one has from its first moment, and holding it while it is counted."""

from __future__ import annotations

from sqlalchemy import update
from sqlalchemy.orm import Session

from mosaic_server.storage.tables import Organization, Tab, now_ms

FIRST_TAB = "Default"


def add_organization(session: Session, name: str) -> Organization:
    """With the first, empty tab that original dashboards expect. The name must be free."""
    organization = Organization(name=name)
    session.add(organization)
    session.flush()
    session.add(Tab(organization_id=organization.id, name=FIRST_TAB))
    return organization


def hold_organization(session: Session, organization_id: str) -> None:
    """Until the end of this transaction whoever else holds it waits: what is counted meanwhile stays true."""
    session.execute(update(Organization).where(Organization.id == organization_id).values(updated_at_ms=now_ms()))
