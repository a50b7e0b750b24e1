"""Makes the entry that ``mosaic connectors show`` prints to be pasted: that of the configurer, and for what moves
something the limits that are in force anyway, ready to be made narrower."""

from __future__ import annotations

from typing import Any

import yaml

from mosaic_core.cli.configuration.connector_defaults import Unmade, defaults_of
from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.example import example_of
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.safety_config import FieldBounds

_BOUNDS = FieldBounds.model_fields.keys() - {"kind"}
"""The kind is the connector's own word."""


def shown_example(connector_type: str, configurer: type[Configurer[Any]]) -> dict[str, Any]:
    """One entry of ``connectors:``, with ``safety`` where one of its receivers moves something."""
    example = example_of(connector_type, configurer)
    safety = _own_safety(connector_type, configurer)
    return {**example, "safety": safety} if safety else example


def example_yaml(connector_type: str, configurer: type[Configurer[Any]]) -> str:
    """The example as it is pasted below ``connectors:``."""
    text = yaml.safe_dump([shown_example(connector_type, configurer)], sort_keys=False, allow_unicode=True)
    return "".join(f"  {line}\n" for line in text.splitlines())


def _own_safety(connector_type: str, configurer: type[Configurer[Any]]) -> dict[str, Any]:
    try:
        channels = defaults_of(connector_type, configurer)
    except Unmade:  # which is told where the defaults would stand
        return {}
    moving = [one for channel in channels for one in channel["safety"] if one["timeout_s"] is not None]
    if not moving:
        return {}
    safety: dict[str, Any] = {"timeout_s": moving[0]["timeout_s"]} if len(moving) == 1 else {}
    own = configurer.safety_model.model_fields.keys() - SafetyConfig.model_fields.keys()
    for name, field in configurer.safety_model.model_fields.items():
        if name in own and isinstance(field.default, int | float):
            safety[name] = field.default
    limits = {
        limit["fields"][0]: {name: value for name, value in limit.items() if name in _BOUNDS}
        for one in moving
        for limit in one["limits"]
        if not own  # whose limits are these keys
    }
    return {**safety, "limits": limits} if limits else safety
