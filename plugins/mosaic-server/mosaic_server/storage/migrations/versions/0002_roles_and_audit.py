"""Roles per account and robot, accounts of programs, issued tickets, the audit log."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def _stamped() -> list[sa.Column[object]]:
    return [
        sa.Column("id", sa.String(36), primary_key=True),
        sa.Column("created_at_ms", sa.BigInteger(), nullable=False),
        sa.Column("updated_at_ms", sa.BigInteger(), nullable=False),
    ]


def _robot() -> sa.Column[object]:
    return sa.Column("robot_id", sa.String(36), sa.ForeignKey("robot.id", ondelete="CASCADE"), nullable=False)


def upgrade() -> None:
    # added in place: a batch would rebuild the table, and dropping it would take everything that refers to it along
    op.add_column("organization", sa.Column("default_role", sa.String(20), nullable=False, server_default="operator"))
    op.add_column("account", sa.Column("is_program", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.create_table(
        "robot_grant",
        *_stamped(),
        _robot(),
        sa.Column("account_id", sa.String(36), sa.ForeignKey("account.id", ondelete="CASCADE"), nullable=False),
        sa.Column("role", sa.String(20), nullable=False),
        sa.UniqueConstraint("robot_id", "account_id"),
    )
    op.create_index("ix_robot_grant_account_id", "robot_grant", ["account_id"])
    op.create_table(
        "issued_ticket",
        *_stamped(),
        _robot(),
        sa.Column("account_id", sa.String(36), nullable=False),
        sa.Column("session_id", sa.String(36), nullable=False),
        sa.Column("role", sa.String(20), nullable=False),
        sa.Column("is_program", sa.Boolean(), nullable=False),
        sa.Column("is_over", sa.Boolean(), nullable=False),
    )
    op.create_index("ix_issued_ticket_robot_id", "issued_ticket", ["robot_id"])
    op.create_index("ix_issued_ticket_account_id", "issued_ticket", ["account_id"])
    _audit()


def _audit() -> None:
    op.create_table(
        "audit_entry",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), primary_key=True),
        sa.Column("at_ms", sa.BigInteger(), nullable=False),
        sa.Column("action", sa.String(40), nullable=False),
        sa.Column("organization_id", sa.String(36)),
        sa.Column("actor", sa.String(254), nullable=False),
        sa.Column("account_id", sa.String(36)),
        sa.Column("account", sa.String(254), nullable=False),
        sa.Column("robot_id", sa.String(36)),
        sa.Column("robot", sa.String(200), nullable=False),
        sa.Column("role", sa.String(20), nullable=False),
        sa.Column("address", sa.String(64), nullable=False),
        sa.Column("detail", sa.String(200), nullable=False),
    )
    op.create_index("ix_audit_entry_at_ms", "audit_entry", ["at_ms"])
    op.create_index("ix_audit_entry_organization_id_id", "audit_entry", ["organization_id", "id"])
    op.create_index("ix_audit_entry_action_id", "audit_entry", ["action", "id"])


def downgrade() -> None:
    for table in ("audit_entry", "issued_ticket", "robot_grant"):
        op.drop_table(table)
    op.drop_column("account", "is_program")
    op.drop_column("organization", "default_role")
