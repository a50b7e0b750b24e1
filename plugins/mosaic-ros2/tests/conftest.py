"""A domain of this process alone, on loopback, nodes of ROS in it, and a bus in memory."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from typing import Any

import pytest
from support.devices.ros_side import LOOPBACK, RosNode


@pytest.fixture(scope="session")
def domain() -> Iterator[int]:
    """Others may run the same tests on this machine: each process has a domain of its own."""
    before = os.environ.get("CYCLONEDDS_URI")
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    yield 1 + os.getpid() % 230
    os.environ.pop("CYCLONEDDS_URI") if before is None else os.environ.update(CYCLONEDDS_URI=before)


@pytest.fixture
def here(domain: int) -> dict[str, Any]:
    """The params of a connector in that domain."""
    return {"domain": domain}


@pytest.fixture
def node(domain: int) -> Iterator[RosNode]:
    """A node of ROS in that domain."""
    running = RosNode(domain)
    yield running
    running.close()
    gc.collect()  # Cyclone's entities end when nobody holds them
