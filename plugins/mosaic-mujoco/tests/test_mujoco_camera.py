"""Pictures of a simulation: drawn without a screen, not black, and not at all where there is nothing to draw with."""

from __future__ import annotations

import asyncio
import ctypes
import platform
import subprocess
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mosaic_core import Captured, DeviceGone, Shared
from mosaic_core.contract.checks import CheckContext, NamedConnector
from mosaic_core.testing import build, fake_host, take_frames
from mosaic_core.words.finding import Finding
from mosaic_mujoco import doctor
from mosaic_mujoco.connectors.camera import MujocoCameraConfigurer
from mosaic_mujoco.world.drawing import backend

if TYPE_CHECKING:
    from mosaic_mujoco.world.simulation import Simulation

SMALL = {"width": 128, "height": 96}


def pictures(shared: Shared, count: int, **params: Any) -> list[np.ndarray[Any, Any]]:
    camera = build(MujocoCameraConfigurer, params={**SMALL, **params}, shared=shared)
    taken = take_frames(camera, count)
    assert all(isinstance(one, Captured) for one in taken)
    return [one.image for one in taken]  # type: ignore[union-attr, misc]


@pytest.mark.usefixtures("draws")
def test_a_picture_shows_the_scene_the_right_way_up_in_the_right_colours(shared: Shared, vehicle: Simulation) -> None:
    (picture,) = pictures(shared, 1, model="vehicle", camera="front")
    assert picture.shape == (96, 128, 3)
    assert picture.dtype == np.uint8
    assert picture.std() > 20
    sky, floor = picture[:20].mean(axis=(0, 1)), picture[-20:].mean(axis=(0, 1))
    assert sky[0] > sky[2] + 20  # BGR: the sky is blue
    assert abs(floor[0] - floor[2]) < 20  # the floor is gray


@pytest.mark.usefixtures("draws")
def test_what_moves_is_seen_to_move_and_what_stands_is_drawn_once(shared: Shared, arm: Simulation) -> None:
    first, again = pictures(shared, 2, model="arm", camera="overview")
    assert first is again
    arm.aim({0: 1.5})
    arm.advance(300)
    (moved,) = pictures(shared, 1, model="arm", camera="overview")
    assert np.abs(moved.astype(int) - first.astype(int)).mean() > 1.0


@pytest.mark.usefixtures("draws")
def test_a_reset_is_seen_of_a_simulation_that_is_paused(shared: Shared, arm: Simulation) -> None:
    arm.reset("upright")
    camera = build(MujocoCameraConfigurer, params={**SMALL, "model": "arm", "camera": "overview"}, shared=shared)
    fake_host(camera).arm()
    frames: Any = camera.frames()
    with closing(frames):
        before = next(frames).image
        arm.reset("home")
        assert np.abs(next(frames).image.astype(int) - before.astype(int)).mean() > 1.0


@pytest.mark.usefixtures("draws")
def test_a_free_camera_looks_from_where_it_is_told(shared: Shared, vehicle: Simulation) -> None:
    (above,) = pictures(shared, 1, model="vehicle", elevation_deg=-90, distance_m=6.0)
    (aside,) = pictures(shared, 1, model="vehicle", elevation_deg=-5, azimuth_deg=0, shadows=True)
    assert above.std() > 5
    assert np.abs(above.astype(int) - aside.astype(int)).mean() > 10


def test_mujoco_gl_decides_where_it_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "OSMesa")
    assert backend() == "osmesa"
    monkeypatch.setenv("MUJOCO_GL", "disable")
    with pytest.raises(DeviceGone, match="unset MUJOCO_GL"):
        backend()


def test_without_egl_and_osmesa_a_camera_says_what_to_install(
    shared: Shared, vehicle: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(name: str) -> None:
        raise OSError(name)

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    monkeypatch.setattr(ctypes, "CDLL", nothing)
    with pytest.raises(DeviceGone, match="apt install libegl1 libgl1-mesa-dri"):
        pictures(shared, 1, model="vehicle", camera="front")
    (finding,) = examined(CheckContext())
    assert (finding.status, finding.cure) == ("warn", "apt install libegl1 libgl1-mesa-dri")


def test_osmesa_draws_where_egl_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def osmesa_alone(name: str) -> None:
        if "OSMesa" not in name:
            raise OSError(name)

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(platform, "system", lambda: "Linux")
    monkeypatch.setattr(ctypes, "CDLL", osmesa_alone)
    assert backend() == "osmesa"


@pytest.mark.usefixtures("draws")
def test_the_doctor_draws_a_picture_if_the_robot_has_such_a_camera(tmp_path: Any) -> None:
    camera = NamedConnector("mujoco-camera", "front", None)
    (finding,) = examined(CheckContext((camera,), tmp_path / "robot.yaml"))
    assert finding.status == "ok"
    (finding,) = examined(CheckContext((), tmp_path / "robot.yaml"))
    assert finding.status == "skipped"


def examined(context: CheckContext) -> list[Finding]:
    async def collected() -> list[Finding]:
        return [finding async for finding in doctor.examine(context)]

    return asyncio.run(collected())


def test_mujoco_is_imported_without_opengl_whatever_came_before() -> None:
    code = (
        "import os, sys; from mosaic_mujoco.world.engine import engine; engine(); "
        "assert 'OpenGL' not in sys.modules, 'OpenGL'; assert 'MUJOCO_GL' not in os.environ"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, timeout=60)
