"""The JSON Schema of the YAML file, including what every installed connector takes."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import MosaicError

_REFERENCE = {"type": "string", "pattern": r"\$\{[^{}]+\}", "description": "Filled in from environment or file."}
_NOT_TEXT = ("integer", "number", "boolean")


def config_schema(resolver: ConnectorResolver) -> tuple[dict[str, Any], list[MosaicError]]:
    """The schema (draft 2020-12), and the errors of plugins that could not be asked."""
    schema = RobotConfig.model_json_schema(by_alias=False)
    definitions: dict[str, Any] = schema["$defs"]
    connector: dict[str, Any] = definitions["ConnectorConfig"]
    variants: list[dict[str, Any]] = []
    broken: list[MosaicError] = []
    types = sorted({one.type for one in resolver.types()})
    for name in types:
        try:
            configurer = resolver.resolve(name)
            parts = {
                "params": _part(configurer.params_model, f"{name}.params", definitions),
                "safety": _part(configurer.safety_model, f"{name}.safety", definitions),
            }
        except MosaicError as error:
            broken.append(error)
            continue
        then: dict[str, Any] = {"properties": parts}
        if configurer.params_model.model_json_schema().get("required"):
            then["required"] = ["params"]
        variants.append({"if": {"properties": {"type": {"const": name}}, "required": ["type"]}, "then": then})
    connector["properties"]["type"]["enum"] = types
    connector["allOf"] = variants
    result: dict[str, Any] = _with_references(schema)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **result}, broken


def _part(model: type[BaseModel], prefix: str, definitions: dict[str, Any]) -> dict[str, Any]:
    """The model's schema; what it refers to goes into the common definitions under a name of its own."""
    schema = model.model_json_schema(by_alias=False, ref_template=f"#/$defs/{prefix}.{{model}}")
    for name, definition in schema.pop("$defs", {}).items():
        definitions[f"{prefix}.{name}"] = definition
    schema.pop("title", None)
    return schema


def _with_references(schema: Any) -> Any:
    """Where a number, an id or a URL is wanted, ``${NAME}`` is fine as well."""
    if isinstance(schema, list):
        return [_with_references(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {key: value if key in ("default", "examples") else _with_references(value) for key, value in schema.items()}
    kind = inner.get("type")
    if kind in _NOT_TEXT or (kind == "string" and ("pattern" in inner or "format" in inner or "enum" in inner)):
        outer = {key: inner.pop(key) for key in ("title", "description", "default") if key in inner}
        return {**outer, "anyOf": [inner, _REFERENCE]}
    return inner
