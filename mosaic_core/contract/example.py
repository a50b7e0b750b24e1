"""Makes an example entry of a connector for people to paste, from its configurer alone."""

from __future__ import annotations

from typing import Any

from mosaic_core.contract.configurer import Configurer

_PLACEHOLDERS: dict[str, Any] = {"string": "…", "integer": 1, "number": 1.0, "boolean": True, "array": [], "object": {}}


def example_of(connector_type: str, configurer: type[Configurer[Any]]) -> dict[str, Any]:
    """One entry of ``connectors:``: the configurer's own example, or its required params with placeholders."""
    params = configurer.example
    if params is None:
        schema = configurer.params_model.model_json_schema()
        properties, required = schema.get("properties", {}), schema.get("required", ())
        params = {
            name: field.get("default") if name not in required else _placeholder(field)
            for name, field in properties.items()
            if name in required or field.get("default") is not None
        }
    example: dict[str, Any] = {"type": connector_type, "label": connector_type.lower().replace("-", "_")}
    return {**example, "params": params} if params else example


def _placeholder(field: dict[str, Any]) -> Any:
    for options in ("examples", "enum"):
        if field.get(options):
            return field[options][0]
    return _PLACEHOLDERS.get(str(field.get("type")), "…")
