"""TURN servers that share a secret with us."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("ice_server", sa.Column("secret", sa.String(512)))


def downgrade() -> None:
    op.drop_column("ice_server", "secret")
