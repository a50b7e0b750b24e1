"""Draws pictures of a simulation without a screen: MuJoCo's OpenGL renderer on EGL or OSMesa.

Which of the two is decided when the first camera opens, by what is installed; `MUJOCO_GL` decides where it is set.
Everything of one :class:`Drawing` belongs to the thread that entered it.
"""

from __future__ import annotations

import ctypes
import os
import platform
import threading
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mosaic_core import DeviceGone
from mosaic_mujoco.world.engine import WITHOUT_DRAWING, engine
from mosaic_mujoco.world.simulation import Simulation

DrawnPixels = NDArray[np.uint8]

DEBIAN = "apt install libegl1 libgl1-mesa-dri"
_LIBRARIES = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
_MAX_GEOMS = 10_000
"""More are left out of a picture."""
_opening = threading.Lock()
"""Two threads that open the first display at once would get half of it each."""


def backend() -> str:
    """What draws on this machine: ``egl``, ``osmesa``, ``cgl`` or ``glfw``. Raises :class:`DeviceGone`."""
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if chosen in ("egl", "osmesa", "glfw", "cgl"):
        return chosen
    if chosen == WITHOUT_DRAWING:
        raise DeviceGone("MUJOCO_GL=disable: nothing is drawn", "unset MUJOCO_GL")
    if platform.system() != "Linux":
        return "cgl" if platform.system() == "Darwin" else "glfw"
    for name, library in _LIBRARIES.items():
        with suppress(OSError):
            ctypes.CDLL(library)
            return name
    raise DeviceGone("MuJoCo has nothing to draw with: neither EGL nor OSMesa is installed", DEBIAN)


@dataclass(frozen=True, slots=True)
class FreeView:
    """A view of the whole scene by a camera that is none of the model's; ``None``: as the model says."""

    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    distance_m: float | None = None


class Drawing:
    """Draws what a camera of the simulation sees. ``camera``: a name of the model, or a :class:`FreeView`.

    ``with drawing:`` opens it; raises :class:`DeviceGone` where this machine has nothing to draw with."""

    def __init__(
        self, simulation: Simulation, camera: str | FreeView, width: int, height: int, *, has_shadows: bool
    ) -> None:
        self._simulation = simulation
        self._camera = camera
        self._size = width, height
        self._has_shadows = has_shadows
        self._surface: Any = None
        self._context: Any = None

    def __enter__(self) -> Drawing:
        mujoco, model = engine(), self._simulation.model
        width, height = self._size
        name = backend()
        with _opening:
            try:
                self._surface = import_module(f"mujoco.{name}").GLContext(width, height)
                self._surface.make_current()
                visual = model.vis.global_
                visual.offwidth, visual.offheight = max(visual.offwidth, width), max(visual.offheight, height)
                self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            except (ImportError, RuntimeError, OSError, AttributeError, mujoco.FatalError) as error:
                self._close()
                raise DeviceGone(f"MuJoCo can't draw with {name}: {error}", DEBIAN) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._data = mujoco.MjData(model)
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = self._has_shadows
        self._option = mujoco.MjvOption()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = 0
        self._view = self._placed_view()
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def drawn(self) -> DrawnPixels:
        """What the camera sees now: BGR, (height, width, 3). The simulation waits for a copy of its state alone."""
        mujoco, model = engine(), self._simulation.model
        width, height = self._size
        self._simulation.look(lambda data: mujoco.mj_copyData(self._data, model, data))
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(model, self._data, self._option, None, self._view, everything, self._scene)
        frame = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(frame, self._scene, self._context)
        pixels: DrawnPixels = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(pixels, None, frame, self._context)
        return np.ascontiguousarray(pixels[::-1, :, ::-1])  # OpenGL begins below, and with red

    def _placed_view(self) -> Any:
        mujoco, model, camera = engine(), self._simulation.model, self._camera
        view = mujoco.MjvCamera()
        if isinstance(camera, str):
            view.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
            view.fixedcamid = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA.value, camera)
            return view
        mujoco.mjv_defaultFreeCamera(model, view)
        view.azimuth = view.azimuth if camera.azimuth_deg is None else camera.azimuth_deg
        view.elevation = view.elevation if camera.elevation_deg is None else camera.elevation_deg
        view.distance = view.distance if camera.distance_m is None else camera.distance_m
        return view

    def _close(self) -> None:
        context, surface = self._context, self._surface
        self._context = self._surface = None
        if context is not None:
            context.free()
        if surface is not None:
            surface.free()
