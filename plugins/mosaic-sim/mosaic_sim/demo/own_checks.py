"""Checks a connector that ``--with`` has brought as far as its kind allows without knowing what it means."""

from __future__ import annotations

from mosaic_core.operator import RobotConnection
from mosaic_core.words.data_type import Direction, Kind
from mosaic_sim.demo.checks import CheckFailed, messages_arrive

UNPROVEN = frozenset(("announced", "takes messages", "answers requests"))
"""What is said of a connector that nothing was seen of but its channel."""


async def own_works(connection: RobotConnection, label: str) -> str:
    """What was seen of it: a picture, a message, or that it is open. Raises :class:`CheckFailed`, and
    :class:`TimeoutError` where nothing arrives."""
    entries = connection.catalogue.entries if connection.catalogue else ()
    entry = next((one for one in entries if one.label == label), None)
    if entry is None:
        raise CheckFailed("the robot does not announce it")
    if entry.kind is Kind.VIDEO:
        picture = await connection.media(label).next_image()
        return f"{picture.shape[1]}×{picture.shape[0]}"
    if entry.kind is Kind.AUDIO:
        return "announced"
    if entry.direction is Direction.TO_OPERATOR:
        return await messages_arrive(connection.receivable(label))
    is_both = entry.direction is Direction.BOTH
    store = connection.bidirectional(label) if is_both else connection.sendable(label)
    await store.wait_open(5.0)
    return "answers requests" if entry.answer_schema else "takes messages"
