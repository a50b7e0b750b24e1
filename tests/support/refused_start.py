"""What keeps a robot from starting, for tests of mistakes that are told before anything runs."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.laboratory.joining import checked_config
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.testing import connector
from mosaic_core.words.errors import ConfigError, Problem


def problems_at_start(configurer: Any, **entry: Any) -> list[Problem]:
    """Why a robot with this one connector does not start; ``entry``: what its file says of the connector."""
    auto = AutoConfigurer(resolver=ConnectorResolver([]), plugins=hook_plugins([]))
    with pytest.raises(ConfigError) as refused:
        auto.configure(checked_config([connector(configurer, **entry)]))
    return [*refused.value.problems]
