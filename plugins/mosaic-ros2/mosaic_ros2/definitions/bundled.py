"""Holds the definitions that this distribution brings: text files beside this module, one message a line."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from mosaic_ros2.definitions.definition import Definition, Field
from mosaic_ros2.definitions.msg_text import action_messages, field_type

_FILES = ("common_interfaces.txt", "further_messages.txt", "services_and_actions.txt")

DISTRIBUTIONS = ("humble", "iron", "jazzy", "kilted")
"""The distributions of ROS that are known, the oldest first."""


def read_line(line: str) -> tuple[str, Definition]:
    """``package/msg/Name@humble: type name, type name`` as a definition, and the distribution after the ``@``."""
    head, _, body = line.partition(": ")
    name, _, until = head.partition("@")
    package = name.split("/")[0]
    pairs = (field.split(" ") for field in body.strip().split(", "))
    return until, Definition(name, tuple(Field(own, field_type(kind, package)) for kind, own in pairs))


def holds_in(until: str, distribution: str) -> bool:
    """Whether a form that ``until`` was the last to have is the one of ``distribution``."""
    if distribution not in DISTRIBUTIONS:
        return not until
    return not until or DISTRIBUTIONS.index(distribution) <= DISTRIBUTIONS.index(until)


@cache
def bundled(distribution: str = "") -> dict[str, Definition]:
    """Every bundled definition by its name, as this distribution of ROS has it; one that is not known, or empty: as
    the newest."""
    found: dict[str, Definition] = {}
    for file in _FILES:
        for line in files(__package__).joinpath(file).read_text(encoding="utf-8").splitlines():
            if line and not line.startswith("#"):
                until, definition = read_line(line)
                if holds_in(until, distribution):  # the older forms come later, and take the place of the newer
                    found[definition.name] = definition
    for name in [one.removesuffix("_Goal") for one in found if "/action/" in one and one.endswith("_Goal")]:
        found |= {one.name: one for one in action_messages(name)}
    return found
