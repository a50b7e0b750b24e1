"""Writes the robot's file of `mosaic mujoco init`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import typer
import yaml

from mosaic_core.words.errors import MosaicError
from mosaic_mujoco.cli.listing import facts_or_error
from mosaic_mujoco.cli.robot_file import Entry, WheelSizes, connectors_of, sides_of
from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.facts import ModelFacts
from mosaic_mujoco.world.model_file import OWN_MODELS, compiled, model_path

_HEAD = """\
# {name}, simulated by MuJoCo. `mosaic mujoco show {model}` lists what else the model has.
# On its own: mosaic run {file} --serve 127.0.0.1:9002
version: 1
# To register it with a server, which says its robot_id and token:
# server:
#   ws_url: wss://mosaic.example.org
#   auth: {{ type: simple-token, robot_id: "${{MOSAIC_ROBOT_ID}}", params: {{ token: "${{MOSAIC_TOKEN}}" }} }}

connectors:
"""


def write_robot(model: str, output: Path, *, overwrites: bool) -> None:
    """Raises :class:`MosaicError` for a model that can't be read, a file that stands there already, and one
    that can't be written."""
    facts = facts_or_error(model)
    named = model if model in OWN_MODELS else os.fspath(Path(model).expanduser())
    text = robot_text(named, facts, wheel_sizes(model, facts), str(output))
    if str(output) == "-":
        typer.echo(text, nl=False)
        return
    if output.exists() and not overwrites:
        raise MosaicError(f"{output} exists", code="config.invalid", cure="add --force, or name another file")
    try:
        output.write_text(text, "utf-8")
    except OSError as error:
        message = f"{output} can't be written: {error.strerror}"
        raise MosaicError(message, code="config.invalid", cure="name a file in a folder that you may write") from error
    typer.echo(f"Wrote {output}. Next: mosaic validate {output}, then mosaic run {output} --serve 127.0.0.1:9002")


def robot_text(model: str, facts: ModelFacts, wheels: WheelSizes, file: str) -> str:
    """The file as text."""
    head = _HEAD.format(name=facts.name, model=model, file=file)
    return head + "".join(_line(entry) for entry in connectors_of(model, facts, wheels))


def _line(entry: Entry) -> str:
    """In YAML's short form, which is a line of its own for each connector."""
    text = yaml.safe_dump(entry, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10_000)
    return f"  - {text.strip()}\n"


def wheel_sizes(model: str, facts: ModelFacts) -> WheelSizes:
    """Measured where the model stands by itself: the roundest shape of a wheel's body, and how far both sides are
    apart."""
    left, right = sides_of(facts)
    if not left or not right:
        return WheelSizes()
    mujoco, made = engine(), compiled(model_path(model))
    data = mujoco.MjData(made)
    mujoco.mj_forward(made, data)
    joints = [facts.joint(side[0].joint or "").id for side in (left, right)]
    bodies = [int(made.jnt_bodyid[joint]) for joint in joints]
    apart_m = float(np.linalg.norm(data.xanchor[joints[0]] - data.xanchor[joints[1]]))
    return WheelSizes(_radius_m(made, bodies[0]), apart_m or None)


def _radius_m(model: Any, body: int) -> float | None:
    kinds = engine().mjtGeom
    shapes = (kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE, kinds.mjGEOM_ELLIPSOID)
    round_ones = [
        float(model.geom_size[number][0])
        for number in range(model.ngeom)
        if int(model.geom_bodyid[number]) == body and int(model.geom_type[number]) in [kind.value for kind in shapes]
    ]
    return max(round_ones, default=None)
