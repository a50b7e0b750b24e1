"""Devices that were paired on the robot's own network, and the offers that pair them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def _stamps() -> list[sa.Column[object]]:
    return [
        sa.Column("created_at_ms", sa.BigInteger(), nullable=False),
        sa.Column("updated_at_ms", sa.BigInteger(), nullable=False),
    ]


def upgrade() -> None:
    op.create_table(
        "paired_device",
        sa.Column("id", sa.String(36), sa.ForeignKey("account.id", ondelete="CASCADE"), primary_key=True),
        *_stamps(),
        sa.Column("address", sa.String(64), nullable=False),
    )
    op.create_table(
        "pairing_offer",
        sa.Column("id", sa.String(36), primary_key=True),
        *_stamps(),
        sa.Column("pin_hash", sa.String(64)),
        sa.Column("code_hash", sa.String(64), nullable=False),
        sa.Column("role", sa.String(20)),
        sa.Column("expires_at_ms", sa.BigInteger(), nullable=False),
        sa.Column("wrong_pins", sa.Integer(), nullable=False),
        sa.Column("taken_by", sa.String(36)),
    )


def downgrade() -> None:
    for table in ("pairing_offer", "paired_device"):
        op.drop_table(table)
