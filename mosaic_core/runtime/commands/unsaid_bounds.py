"""Says a bound that a command could say and leaves out: unsaid it would be none, and the limit of it would bound
nothing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from mosaic_core.contract.message_fields import is_bound, may_lack
from mosaic_core.words.limits import FieldLimit


class UnsaidBounds:
    """The numbers ``max_…`` of one receiver's messages that a message may be without, and that ``limits`` bound above;
    each is its limit where nobody says it."""

    def __init__(self, message_type: Any, limits: Iterable[FieldLimit]) -> None:
        greatest = {field: limit.max for limit in limits for field in limit.fields if limit.max is not None}
        paths = {tuple(field.split(".")): bound for field, bound in greatest.items() if is_bound(field)}
        self._bounds = {path: bound for path, bound in paths.items() if may_lack(message_type, path)}

    def said(self, message: dict[str, Any]) -> dict[str, Any]:
        """``message`` with them; it stays as it is."""
        for path, bound in self._bounds.items():
            message = _with(message, path, bound)
        return message


def _with(message: dict[str, Any], path: tuple[str, ...], bound: float) -> dict[str, Any]:
    """A copy with ``bound`` at ``path``, if what it belongs to is there and does not say it."""
    key, *inner = path
    if not inner:
        return message if key in message else {**message, key: bound}
    part = message.get(key)
    return {**message, key: _with(part, tuple(inner), bound)} if isinstance(part, dict) else message
