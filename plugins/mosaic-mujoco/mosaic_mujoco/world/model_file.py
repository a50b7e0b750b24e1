"""Finds and compiles a model's file, and says what is wrong with it in MuJoCo's words, with file and line."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from mosaic_core.words.errors import hint_at
from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.facts import ModelFacts
from mosaic_mujoco.world.reading import facts_of

OWN_MODELS = ("arm", "vehicle")
"""Those of the package, which need no path."""
_LINE = re.compile(r"line(?: number)?[ =](\d+)", re.IGNORECASE)
MAX_KEPT = 8


class ModelUnreadable(ValueError):
    """A model's file that can't be used. The text begins with the file, and the line if MuJoCo names one."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model's file as it stood on the disk when it was looked at."""

    path: Path
    stamp: tuple[int, int]


def model_path(model: str) -> Path:
    """Where the file of ``model`` is: one of our own, or a path. Raises :class:`ModelUnreadable`."""
    if model in OWN_MODELS:
        return Path(str(files("mosaic_mujoco.robots") / f"{model}.xml"))
    path = Path(model).expanduser()
    if not path.is_file():
        own = f"{hint_at(model, OWN_MODELS)} This package has {' and '.join(OWN_MODELS)}"
        raise ModelUnreadable(f"{path.absolute()}: there is no such file{own}; others are named by their path")
    return path.absolute()


def facts_of_file(model: str) -> ModelFacts:
    """What ``model`` has; read once as long as the file stays the same. Raises :class:`ModelUnreadable`."""
    path = model_path(model)
    stat = path.stat()
    return _kept_facts(ModelFile(path, (stat.st_mtime_ns, stat.st_size)))


@lru_cache(MAX_KEPT)
def _kept_facts(file: ModelFile) -> ModelFacts:
    return facts_of(compiled(file.path), file.path.stem)


def compiled(path: Path) -> Any:
    """The ``MjModel`` of a file of MJCF, URDF or MuJoCo's own binary form. Raises :class:`ModelUnreadable`."""
    mujoco = engine()
    read = mujoco.MjModel.from_binary_path if path.suffix == ".mjb" else mujoco.MjModel.from_xml_path
    try:
        return read(os.fspath(path))
    except (ValueError, mujoco.FatalError) as error:
        said = " ".join(str(error).split())
        line = _LINE.search(said)
        place = f"{path}:{line[1]}" if line else str(path)
        raise ModelUnreadable(f"{place}: MuJoCo can't read it: {said}") from None
