"""The audit log of an organization, for its administrators; nobody can change it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import Envelope, iso_time
from mosaic_server.rest.signed_in import AdminDep, ServicesDep
from mosaic_server.storage.audit import AuditAction, AuditEntry, audit_page

router = APIRouter(prefix="/api/v1/audit", tags=["audit"])


class AuditLine(WireModel):
    """An entry of the audit log: ``actor`` did ``action`` to ``account`` (on ``robot``, with ``role``) at ``at``, from
    ``address``.
    """

    id: int
    at: str
    action: AuditAction
    actor: str
    account_id: str | None
    account: str
    robot_id: str | None
    robot: str
    role: str
    address: str
    detail: str


class AuditPage(WireModel):
    """A page of the audit log. ``next``: give it as ``before`` for the next page; null at the end."""

    data: list[AuditLine]
    next: int | None


@router.get("")
async def show_audit(
    admin: AdminDep,
    services: ServicesDep,
    before: Annotated[int | None, Query(ge=1, le=2**63 - 1)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
    action: AuditAction | None = None,
) -> Envelope[AuditPage]:
    """The newest entries first."""
    found = await services.database.run(
        audit_page, admin.organization_id, limit=limit + 1, before=before, action=action
    )
    page = found[:limit]
    more = page[-1].id if len(found) > limit else None
    return Envelope(resultData=AuditPage(data=[audit_line(entry) for entry in page], next=more))


def audit_line(entry: AuditEntry) -> AuditLine:
    return AuditLine(
        id=entry.id,
        at=iso_time(entry.at_ms),
        action=entry.action,
        actor=entry.actor,
        account_id=entry.account_id,
        account=entry.account,
        robot_id=entry.robot_id,
        robot=entry.robot,
        role=entry.role,
        address=entry.address,
        detail=entry.detail,
    )
