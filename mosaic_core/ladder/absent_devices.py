"""Takes a connector's device or host away, by its params, and hears what its code says then."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.drill.commands import NoCommand, moving_command
from mosaic_core.harness.building import build
from mosaic_core.harness.feeding import feed
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.lives import BEGIN_S, must_be_run
from mosaic_core.ladder.trial_run import entered, trial_run
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.errors import MosaicError, Refused

ABSENT = "/dev/mosaic-no-such-device"
NOWHERE = "mosaic-no-such-host.invalid"
"""RFC 2606 §2 promises that nobody ever has a name below ``invalid``; to be told so needs no network."""
_DEVICES = {"port", "device", "source", "path", "file", "camera_id"}
_HOSTS = {"host", "url", "broker", "server", "address"}


async def absent_device_errors(one: Examinee) -> list[tuple[str, str, BaseException]]:
    """``(param, value, error)`` for each param of its example that names a device or a host, where none is; nothing
    where it runs without. Raises :class:`NotJudged`."""
    must_be_run(one)
    found: list[tuple[str, str, BaseException]] = []
    for name, absent, params in without_device({**_default_texts(one), **one.example}):
        error = await _error_with(one, params)
        if error is not None:
            found.append((name, absent, error))
    return found


async def _error_with(one: Examinee, params: Mapping[str, Any]) -> BaseException | None:
    try:
        configured = one.configured(params)
    except MosaicError:
        return None  # a path is no value for this param: it names something else
    receivers = [
        handler
        for connector in configured.connectors
        for handler in connector.handlers
        if isinstance(handler, DataChannelReceivable)
    ]
    try:
        async with entered(configured), trial_run(configured) as run:
            await run.begun(BEGIN_S)
    except Exception as error:  # noqa: BLE001 - a plugin's code may fail in any way
        return error
    if run.failures or not receivers:
        return next(iter(run.failures), None)
    return await asyncio.to_thread(_error_of_command, one, params)


def _error_of_command(one: Examinee, params: Mapping[str, Any]) -> BaseException | None:
    """What a receiver says that gets a gentle command and has no device."""
    made: Any = build(one.configurer, params=params)
    for handler in made if isinstance(made, list | tuple) else [made]:
        if not isinstance(handler, DataChannelReceivable) or isinstance(handler, RequestHandler):
            continue  # nothing is asked here: a question may take its time
        try:
            command = moving_command(handler, ReceiverSafety.of(one.configurer.safety_model(), handler))
            feed(handler, [command.message])
        except (NoCommand, Refused):
            continue
        except Exception as error:  # noqa: BLE001 - a plugin's code may fail in any way
            return error
    return None


def _default_texts(one: Examinee) -> dict[str, str | Path]:
    """What its params say where the example says nothing: ``/dev/ttyUSB0`` as likely as not."""
    fields = one.configurer.params_model.model_fields.items()
    return {name: info.default for name, info in fields if isinstance(info.default, str | Path)}


def without_device(params: Mapping[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Copies of ``params`` with one device or host less, by the name of the param at any depth, and what stands in its
    place."""
    for name, value in params.items():
        if isinstance(value, Mapping):
            for inner, absent, less in without_device(value):
                yield f"{name}.{inner}", absent, {**params, name: less}
        elif isinstance(value, str | Path) and (absent := _in_place_of(name, str(value))):
            yield name, absent, {**params, name: absent}


def _in_place_of(name: str, value: str) -> str:
    """What names nothing that there is, spelt like ``value``; empty where it names neither a device nor a host."""
    url = urlsplit(value)
    if url.hostname and "://" in value:
        return urlunsplit((url.scheme, url.netloc.replace(url.hostname, NOWHERE), *url[2:]))
    if name in _DEVICES or value.startswith(("/dev/", "/sys/")):
        return f"{ABSENT}{Path(value).suffix}"
    return NOWHERE if name in _HOSTS else ""
