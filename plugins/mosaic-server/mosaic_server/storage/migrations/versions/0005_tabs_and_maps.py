"""Dashboard tabs and occupancy maps, as original dashboards keep them. Every organization has a first tab."""

from __future__ import annotations

import time
from uuid import uuid4

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def _stamped() -> list[sa.Column[object]]:
    return [
        sa.Column("id", sa.String(36), primary_key=True),
        sa.Column("created_at_ms", sa.BigInteger(), nullable=False),
        sa.Column("updated_at_ms", sa.BigInteger(), nullable=False),
    ]


def _organization() -> sa.Column[object]:
    key = sa.ForeignKey("organization.id", ondelete="CASCADE")
    return sa.Column("organization_id", sa.String(36), key, nullable=False)


def upgrade() -> None:
    tab = op.create_table(
        "tab",
        *_stamped(),
        _organization(),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("tab_config", sa.Text(), nullable=False),
    )
    op.create_index("ix_tab_organization_id", "tab", ["organization_id"])
    op.create_table(
        "occupancy_map",
        *_stamped(),
        _organization(),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("pgm_name", sa.String(100), nullable=False),
        sa.Column("yaml_name", sa.String(100), nullable=False),
        sa.Column("pgm", sa.LargeBinary(), nullable=False),
        sa.Column("yaml", sa.LargeBinary(), nullable=False),
    )
    op.create_index("ix_occupancy_map_organization_id", "occupancy_map", ["organization_id"])
    _first_tabs(tab)


def _first_tabs(tab: sa.Table) -> None:
    now_ms = time.time_ns() // 1_000_000
    organizations = op.get_bind().execute(sa.text("SELECT id FROM organization")).scalars().all()
    first_tabs = [
        {
            "id": str(uuid4()),
            "created_at_ms": now_ms,
            "updated_at_ms": now_ms,
            "organization_id": organization_id,
            "name": "Default",
            "tab_config": '{"widgets":[]}',
        }
        for organization_id in organizations
    ]
    op.bulk_insert(tab, first_tabs)


def downgrade() -> None:
    op.drop_table("occupancy_map")
    op.drop_table("tab")
