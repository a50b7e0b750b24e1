"""``mosaic server audit``: who granted, connected and failed to log in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import AsJson, DatabaseUrl, DataDir, fail, known_person, nearest, opened, show_table

if TYPE_CHECKING:
    from mosaic_server.storage.audit import AuditAction


def audit(
    limit: Annotated[int, typer.Option(min=1, max=100_000, help="How many entries.")] = 50,
    before: Annotated[int | None, typer.Option(min=1, help="Only entries with ids below this.")] = None,
    action: Annotated[str, typer.Option(help="Only this kind, e.g. login.failed.")] = "",
    organization_of: Annotated[str, typer.Option(help="Only of this account's organization.")] = "",
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Show the audit log, newest first."""
    from mosaic_server.rest.audit import audit_line
    from mosaic_server.storage.audit import audit_page

    kind = _action(action) if action else None
    with opened(data_dir, database) as db:
        organization_id = known_person(db, organization_of).organization_id if organization_of else None
        entries = db.work(audit_page, organization_id, limit=limit, before=before, action=kind)
    lines = [audit_line(entry).wire() for entry in entries]
    if not as_json:
        shown = ("id", "at", "action", "actor", "account", "robot", "role", "address", "detail")
        lines = [{name: line.get(name) for name in shown} for line in lines]
    show_table(lines, as_json=as_json)


def _action(action: str) -> AuditAction:
    from mosaic_server.storage.audit import AuditAction

    if action not in list(AuditAction):
        guess = nearest(action, AuditAction)
        fail(f"no action {action!r}{guess or '; there are ' + ', '.join(AuditAction)}", exit_code=2)
    return AuditAction(action)
