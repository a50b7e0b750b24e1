"""Ids on the wire are UUIDs in their canonical 36-character spelling; nothing else is looked up."""

from __future__ import annotations

from uuid import UUID


def is_uuid(text: str) -> bool:
    try:
        return str(UUID(text)) == text.lower()
    except ValueError:
        return False
