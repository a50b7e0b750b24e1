"""Organizations, accounts, robots, ICE servers, keys."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
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
    return sa.Column("organization_id", sa.String(36), key, nullable=False, index=True)


def upgrade() -> None:
    op.create_table("organization", *_stamped(), sa.Column("name", sa.String(254), nullable=False, unique=True))
    op.create_table(
        "account",
        *_stamped(),
        _organization(),
        sa.Column("email", sa.String(254), nullable=False, unique=True),
        sa.Column("full_name", sa.String(200), nullable=False),
        sa.Column("password_hash", sa.String(200), nullable=False),
        sa.Column("is_active", sa.Boolean(), nullable=False),
        sa.Column("is_organization_admin", sa.Boolean(), nullable=False),
        sa.Column("login_version", sa.Integer(), nullable=False),
    )
    op.create_table(
        "robot",
        *_stamped(),
        _organization(),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("description", sa.Text(), nullable=False),
        sa.Column("auth_type", sa.Integer(), nullable=False),
        sa.Column("token_hash", sa.String(64)),
        sa.Column("connector_config", sa.Text()),
        sa.Column("catalogue", sa.Text()),
    )
    op.create_table(
        "ice_server",
        *_stamped(),
        sa.Column("urls", sa.Text(), nullable=False),
        sa.Column("username", sa.String(512)),
        sa.Column("credential", sa.String(512)),
    )
    op.create_table(
        "server_key",
        *_stamped(),
        sa.Column("purpose", sa.String(50), nullable=False),
        sa.Column("secret", sa.LargeBinary(), nullable=False),
        sa.UniqueConstraint("purpose"),
    )


def downgrade() -> None:
    for table in ("server_key", "ice_server", "robot", "account", "organization"):
        op.drop_table(table)
