"""Checks for `mosaic doctor` whether MuJoCo can draw on this machine."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from mosaic_core import DeviceGone
from mosaic_core.contract.checks import CheckContext
from mosaic_core.words.errors import whole_sentence
from mosaic_core.words.finding import Finding, passed, skipped, warned

CHECK = "mujoco.drawing"
TYPE = "mujoco-camera"


async def examine(context: CheckContext) -> AsyncIterator[Finding]:
    """One small picture, if the robot has such a camera: who has none needs nothing to draw with."""
    if context.config_path is not None and not context.of_types(TYPE):
        yield skipped(CHECK, "The robot has no camera of a MuJoCo model.")
        return
    try:
        yield await asyncio.wait_for(asyncio.to_thread(drawing_finding), context.timeout_s)
    except TimeoutError:
        yield warned(CHECK, "media.no_first_frame", "MuJoCo drew no picture in time.")


def drawing_finding() -> Finding:
    """Blocks: it draws."""
    from mosaic_mujoco.world.drawing import Drawing, FreeView, backend
    from mosaic_mujoco.world.model_file import model_path
    from mosaic_mujoco.world.simulation import Simulation

    try:
        with Drawing(Simulation(model_path("vehicle")), FreeView(), 64, 48, has_shadows=False) as drawing:
            drawing.drawn()
            return passed(CHECK, f"MuJoCo draws pictures with {backend()}.")
    except DeviceGone as error:
        return warned(CHECK, "plugin.no_device", whole_sentence(error.message), error.cure)
