"""Knows the units of fields: the one that a field declares, or the one that its name ends with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_UNITS = {
    "_s": "s", "_ms": "ms", "_us": "µs", "_hz": "Hz", "_m": "m", "_mm": "mm", "_mps": "m/s", "_radps": "rad/s",
    "_mps2": "m/s²", "_radps2": "rad/s²", "_rad": "rad", "_deg": "°", "_v": "V", "_a": "A", "_bps": "bit/s",
    "_bytes": "B", "_percent": "%", "_c": "°C", "_px": "px", "_kg": "kg",
}  # fmt: skip


def unit_of(name: str, field: Mapping[str, Any]) -> str:
    """The declared unit, or the one that the name ends with."""
    if "unit" in field:
        return str(field["unit"])
    endings = sorted((ending for ending in _UNITS if name.endswith(ending)), key=len)
    return _UNITS[endings[-1]] if endings else ""
