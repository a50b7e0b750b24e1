"""Tells what a limited number of a message is to its receiver: a velocity or a position."""

from __future__ import annotations

from collections.abc import Collection

from mosaic_core.contract.message_fields import MessageFields
from mosaic_core.words.limits import ImpossibleLimit, MotionKind
from mosaic_core.words.safety_config import FieldBounds

_VELOCITIES_CURE = "give each velocity a field of its own, or write `kind: position` if 0 is no standstill"
"""A velocity that a command leaves out has to fall to 0 slowly enough, and a list without it has no place for that."""


def own_kind(
    field: str, fields: MessageFields, velocities: Collection[str], positions: Collection[str]
) -> MotionKind | None:
    """What the receiver itself calls a field; ``None``: nothing. What it calls ``path.*`` holds for every number of
    that list."""
    its = fields.list_of(field)
    if field in positions or (its is not None and its.every in positions):
        return "position"
    return "velocity" if field in velocities else None


def cure_of_kind(own: MotionKind) -> str:
    """Of a limit of another kind than its receiver calls the field."""
    other = "position_fields" if own == "velocity" else "motion_fields"
    return f"remove `kind`, or name it in {other} of its class if that is what it is"


def kind_of(
    field: str,
    bounds: FieldBounds,
    fields: MessageFields,
    velocities: Collection[str],
    positions: Collection[str],
) -> MotionKind:
    """What a limited field is: what the receiver calls it, else what ``bounds`` say, else a velocity. Raises
    :class:`ImpossibleLimit` where the two contradict each other, and for a velocity in a list."""
    own = own_kind(field, fields, velocities, positions)
    if own is not None and bounds.kind not in (None, own):
        message = f"'{field}' is a {own}, and can't be limited as a {bounds.kind}"
        raise ImpossibleLimit(message, key="kind", cure=cure_of_kind(own))
    kind: MotionKind = own or bounds.kind or "velocity"
    if kind == "velocity" and fields.list_of(field) is not None:
        message = f"'{field}' stands in a list, of which only positions can be limited"
        raise ImpossibleLimit(message, cure=_VELOCITIES_CURE)
    return kind
