"""Knows the units of fields: the one that a field declares, or the one that its name ends with; and which there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_UNITS = {
    "_s": "s", "_ms": "ms", "_us": "µs", "_hz": "Hz", "_m": "m", "_mm": "mm", "_mps": "m/s", "_radps": "rad/s",
    "_mps2": "m/s²", "_radps2": "rad/s²", "_rad": "rad", "_deg": "°", "_v": "V", "_a": "A", "_bps": "bit/s",
    "_bytes": "B", "_percent": "%", "_c": "°C", "_px": "px", "_kg": "kg",
}  # fmt: skip


KNOWN_UNITS = frozenset((
    "", *_UNITS.values(),
    "deg", "min", "h", "d", "ns", "kHz", "MHz", "GHz", "rpm", "1/min", "1/s", "1/m", "µm", "cm", "km", "km/h", "kn",
    "cm/s", "mm/s", "deg/s", "°/s", "1/h", "g", "mg", "t", "N", "kN", "mN", "Nm", "mNm", "N/m", "Pa", "hPa", "kPa",
    "MPa", "bar", "mbar", "psi", "J", "kJ", "Wh", "kWh", "mWh", "W", "mW", "kW", "VA", "var", "mV", "µV", "kV",
    "mA", "µA", "Ah", "mAh", "Ω", "kΩ", "MΩ", "F", "µF", "H", "C", "S", "S/m", "µS/cm", "T", "mT", "µT", "G", "K",
    "°F", "lx", "lm", "cd", "cd/m²", "W/m²", "m²", "cm²", "mm²", "m³", "cm³", "L", "mL", "L/s", "L/min", "L/h",
    "m³/s", "m³/h", "kg/m³", "kg/s", "g/m³", "µg/m³", "mol", "mol/L", "mg/L", "ppm", "ppb", "pH", "‰", "dB", "dBm",
    "dBA", "dBi", "bit", "kbit/s", "Mbit/s", "B/s", "kB", "MB", "GB", "kB/s", "MB/s", "sr", "Bq", "Sv", "µSv/h",
    "mSv", "g/L", "m/s³", "rad/s³", "N/mm", "kg·m²", "kgm²", "V/m", "A/m", "mm/min", "Nm/rad", "Nms/rad", "Nm/A",
    "V/s", "A/s", "°C/s", "Pa/s", "%/s", "px/s", "NTU", "FNU", "cm/min", "m/min", "mi", "mph", "ft", "in", "ft/s",
    "lb", "gal", "oz", "steps", "steps/s", "ticks", "ticks/s", "counts", "counts/s", "LSB",
))  # fmt: skip
"""What a declared unit may be: those of SI, and those that robots and their devices are measured in."""


PLACES = frozenset({"m", "mm", "cm", "µm", "km", "rad", "°", "deg", "steps", "ticks", "counts"})
"""The units of places, of which 0 is one like any other: what is given in them is hardly a velocity."""


def unit_of(name: str, field: Mapping[str, Any]) -> str:
    """The declared unit, or the one that the name ends with."""
    if "unit" in field:
        return str(field["unit"])
    endings = sorted((ending for ending in _UNITS if name.endswith(ending)), key=len)
    return _UNITS[endings[-1]] if endings else ""
