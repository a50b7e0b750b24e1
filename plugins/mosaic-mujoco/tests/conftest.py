"""Simulations that stand still until a test advances them, and models of a few lines."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from mosaic_core import DeviceGone, Shared
from mosaic_mujoco.world.drawing import Drawing, FreeView
from mosaic_mujoco.world.live_simulation import shared_simulation
from mosaic_mujoco.world.model_file import model_path
from mosaic_mujoco.world.simulation import Simulation

ModelWriter = Callable[[str], str]


@pytest.fixture
def shared() -> Shared:
    return Shared()


@pytest.fixture
def arm(shared: Shared) -> Simulation:
    return shared_simulation(shared, "arm").simulation


@pytest.fixture
def vehicle(shared: Shared) -> Simulation:
    return shared_simulation(shared, "vehicle").simulation


@pytest.fixture
def written(tmp_path: Path) -> ModelWriter:
    """Writes what stands inside `<mujoco>`, and says where."""

    def write(inner: str) -> str:
        path = tmp_path / "own.xml"
        path.write_text(f"<mujoco>{inner}</mujoco>")
        return str(path)

    return write


@pytest.fixture(scope="session")
def draws() -> None:
    """For tests of pictures: skips where this machine has nothing to draw with, which with `CI=true` is a failure."""
    try:
        with Drawing(Simulation(model_path("vehicle")), FreeView(), 64, 48, has_shadows=False) as drawing:
            drawing.drawn()
    except DeviceGone as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
