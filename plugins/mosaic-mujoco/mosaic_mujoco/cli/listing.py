"""Prints what a model has, for `mosaic mujoco show`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict

import typer

from mosaic_core.cli.terminal.plain_table import print_table
from mosaic_core.words.errors import MosaicError
from mosaic_mujoco.world.facts import ActuatorFact, ModelFacts, Span
from mosaic_mujoco.world.model_file import ModelUnreadable, facts_of_file


def facts_or_error(model: str) -> ModelFacts:
    """What ``model`` has. Raises :class:`MosaicError` for one that can't be read, as commands tell it."""
    try:
        return facts_of_file(model)
    except ModelUnreadable as error:
        cure = "mend the file, or name another one; `mosaic mujoco show arm` shows one that works"
        raise MosaicError(str(error), code="config.invalid", cure=cure) from error


def print_listing(model: str, *, as_json: bool) -> None:
    """To stdout. Raises :class:`MosaicError` for a model that can't be read."""
    facts = facts_or_error(model)
    if as_json:
        typer.echo(json.dumps(asdict(facts)))
        return
    rows = list(_rows(facts))
    if not rows:
        typer.echo(f"{facts.name} has nothing with a name: connectors can name nothing of it.")
        return
    print_table(("what", "name", "kind", "range", "note"), rows, folded=4)


def _rows(facts: ModelFacts) -> Iterator[tuple[str, str, str, str, str]]:
    for name in facts.cameras:
        yield "camera", name, "", "", ""
    for joint in facts.joints:
        yield "joint", joint.name, joint.kind, _range(joint.range, joint.unit), f"of {joint.body}" if joint.body else ""
    for actuator in facts.actuators:
        yield "actuator", actuator.name, actuator.kind, _range(actuator.range, ""), _moves(actuator)
    for sensor in facts.sensors:
        values = "1 value" if sensor.size == 1 else f"{sensor.size} values"
        yield "sensor", sensor.name, sensor.kind, "", f"{values} {sensor.unit}".strip()
    for name in facts.bodies:
        yield "body", name, "", "", ""
    for name in facts.keys:
        yield "key frame", name, "", "", ""


def _range(span: Span | None, unit: str) -> str:
    return "" if span is None else f"{span.low:g} to {span.high:g} {unit}".strip()


def _moves(actuator: ActuatorFact) -> str:
    if actuator.joint is None:
        return "moves no single joint"
    gear = "" if actuator.gear == 1.0 else f", gear {actuator.gear:g}"
    return f"moves {actuator.joint}{gear}"
