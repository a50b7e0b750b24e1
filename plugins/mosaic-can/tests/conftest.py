"""An open bus with another node on it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.devices.can_steps import CanOnSteps


@pytest.fixture
def steps() -> Iterator[CanOnSteps]:
    """An open bus with the sample's DBC file."""
    made = CanOnSteps()
    made.bus.open()
    yield made
    made.bus.close()
    made.node.shutdown()
