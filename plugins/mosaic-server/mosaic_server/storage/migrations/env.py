"""Alembic's entry: always on the connection that :func:`mosaic_server.storage.migrations.upgrade` hands over."""

from __future__ import annotations

from alembic import context

from mosaic_server.storage.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    render_as_batch=True,
)
with context.begin_transaction():
    context.run_migrations()
