"""Tells of an example that the params of its own configurer refuse: whoever pastes it has a mistake to begin with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mosaic_core.contract.configurer import Configurer
from mosaic_core.runtime.configuration.checked_config import CheckedConnector
from mosaic_core.runtime.configuration.config_problems import validated
from mosaic_core.runtime.configuration.yaml_document import YamlDocument
from mosaic_core.runtime.threads.code_places import explained_error, said_at
from mosaic_core.words.errors import Problem

_CURE = "correct it, or leave it out: its defaults are shown then"


def example_hints(one: CheckedConnector) -> Iterator[Problem]:
    """An ``example`` or a ``trial`` that is refused, with its line."""
    for name in ("example", "trial"):
        params = getattr(one.configurer, name)
        cause = refusal(one.configurer, params) if params is not None else ""
        if cause:
            message = f"the {name} of {one.configurer.__name__} is refused by its own params: {cause}"
            yield one.broken(message, cure=_CURE, at=said_at(one.configurer, name))


def refusal(configurer: type[Configurer[Any]], params: dict[str, Any]) -> str:
    """Why the params of a configurer refuse these; empty where they take them."""
    try:
        problems = validated(configurer.params_model, params, YamlDocument({"params": params}), ("params",))[1]
    except Exception as error:  # noqa: BLE001 - a plugin's validators may fail in any way
        return explained_error(error)
    return "; ".join(map(str, problems))
