"""What keeps a robot from starting, for tests of mistakes that are told before anything runs."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.laboratory.joining import configured_with
from mosaic_core.testing import connector
from mosaic_core.words.errors import ConfigError, Problem


def problems_at_start(configurer: Any, **entry: Any) -> list[Problem]:
    """Why a robot with this one connector does not start; ``entry``: what its file says of the connector."""
    with pytest.raises(ConfigError) as refused:
        configured_with([connector(configurer, **entry)])
    return [*refused.value.problems]
