"""``mosaic server organization``: the role that plain accounts have where nothing was granted."""

from __future__ import annotations

from typing import Annotated

import typer

from mosaic_server.cli.grants import role_named
from mosaic_server.cli.options import (
    AsJson,
    DatabaseUrl,
    DataDir,
    chosen_organization,
    opened,
    role_refusals,
    show,
)


def organization(
    default_role: Annotated[
        str, typer.Option(help="Role of plain accounts where nothing is granted: observer, operator or supervisor.")
    ] = "",
    organization_of_email: Annotated[
        str,
        typer.Option(
            "--organization-of", help="E-mail of an account of the organization; needed if there are several."
        ),
    ] = "",
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Show an organization, or with --default-role change what its plain accounts may do."""
    from mosaic_server.storage.grants import BY_COMMAND
    from mosaic_server.storage.members import organization_of, set_default_role

    role = role_named(default_role) if default_role else None
    with opened(data_dir, database) as db:
        organization_id = chosen_organization(db, organization_of_email, "--organization-of")
        if role is not None:
            with role_refusals():
                db.work(set_default_role, organization_id, role, BY_COMMAND)
        found = db.work(organization_of, organization_id)
    record = {"id": found.id, "name": found.name, "defaultRole": found.default_role.value}
    text = f"organization: {found.name}\ndefault role: {found.default_role.value}"
    show(record, as_json=as_json, text=text)
