"""Checks a connector that ``--with`` has brought as far as its kind allows without knowing what it means."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Collection, Iterable

import httpx

from mosaic_core.operator import RobotConnection
from mosaic_core.runtime.widgets.page_faults import page_faults
from mosaic_core.words.catalogue import CatalogueEntry, WidgetModule
from mosaic_core.words.data_type import Direction, Kind
from mosaic_sim.demo.checks import CheckFailed, messages_arrive

UNPROVEN = frozenset(("announced", "takes messages", "answers requests"))
"""What is said of a handler that nothing was seen of but its channel."""


async def own_works(connection: RobotConnection, label: str, url: str, labels: Collection[str] = ()) -> str:
    """What was seen of it and all its handlers: a picture, a message, or that it is open. ``url``: the server's, which
    serves its widget. ``labels``: those of all connectors. Raises :class:`CheckFailed`, and :class:`TimeoutError` where
    nothing arrives."""
    entries = connection.catalogue.entries if connection.catalogue else ()
    its = [one for one in entries if (one.connector or owner_of(one.label, {label, *labels})) == label]
    if not its:
        raise CheckFailed("the robot does not announce it")
    return ", ".join(dict.fromkeys([await _seen(connection, entry, url) for entry in its]))


def owner_of(handler: str, connectors: Iterable[str]) -> str | None:
    """The connector that a handler of this label is of: by custom it begins with that connector's own label, and where
    several fit (``lamp``, ``lamp_post``) with the longest."""
    fitting = [one for one in connectors if f"{handler}_".startswith(f"{one}_")]
    return max(fitting, key=len, default=None)


async def _seen(connection: RobotConnection, entry: CatalogueEntry, url: str) -> str:
    label = entry.label
    if entry.widget_module is not None and entry.widget is not None:
        text = await _served_widget(url, entry.widget_module)
        await asyncio.to_thread(_check_widget, f"{entry.widget_module.name}.js", text, entry.widget)
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


def _check_widget(file: str, text: str, hint: str) -> None:
    """Raises :class:`CheckFailed` for a module that the page can't load."""
    for fault in page_faults(text, hint.partition("/")[2]):
        place = file if fault.line is None else f"{file}:{fault.line}"
        raise CheckFailed(f"the page can't load its widget '{hint}': {place} {fault.message}")


async def _served_widget(url: str, module: WidgetModule) -> str:
    """Its text. Raises :class:`CheckFailed`."""
    # trust_env: a proxy named in the environment can't reach our loopback.
    async with httpx.AsyncClient(base_url=url, trust_env=False, timeout=10.0) as client:
        answer = await client.get(f"/widgets/{module.sha256}.js")
    if answer.status_code != httpx.codes.OK or hashlib.sha256(answer.content).hexdigest() != module.sha256:
        raise CheckFailed(f"the server does not have the widget of {module.distribution} {module.version}")
    return answer.content.decode()
