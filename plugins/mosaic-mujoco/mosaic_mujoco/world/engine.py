"""Imports MuJoCo so that the order of imports and the environment decide nothing.

`import mujoco` itself chooses how pictures are drawn, from `MUJOCO_GL` as it stands at that moment, and fails or warns
where that is not installed. Here it is imported without that choice, unless somebody has made it; cameras choose when
the first of them opens (:mod:`mosaic_mujoco.world.drawing`).
"""

from __future__ import annotations

import logging
import os
from functools import cache
from importlib import import_module
from typing import Any

_log = logging.getLogger(__name__)

WITHOUT_DRAWING = "disable"


@cache
def engine() -> Any:
    """The module ``mujoco``, imported when it is first asked for, which takes some tenths of a second. Any thread."""
    chosen = os.environ.get("MUJOCO_GL")
    os.environ.setdefault("MUJOCO_GL", WITHOUT_DRAWING)
    try:
        mujoco = import_module("mujoco")
    finally:
        if chosen is None:
            os.environ.pop("MUJOCO_GL", None)
    # MuJoCo would write a file MUJOCO_LOG.TXT into whatever folder the robot runs in.
    mujoco.set_mju_user_warning(_told)
    return mujoco


def _told(message: str) -> None:
    """A warning of the engine; what becomes of an unstable simulation is told where it is noticed."""
    _log.debug("MuJoCo: %s", message)
