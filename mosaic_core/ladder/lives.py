"""Lives through starts and ends of a connector, and finds what went wrong in them and what is left over."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit, urlunsplit
from weakref import WeakKeyDictionary

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.doctor.code_checks import blocking_lines
from mosaic_core.drill.commands import NoCommand, moving_command
from mosaic_core.harness.building import build
from mosaic_core.harness.feeding import feed
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import CodePlace, NotJudged
from mosaic_core.ladder.shipment import MAX_FILES
from mosaic_core.ladder.source_places import place_of_frames
from mosaic_core.ladder.trial_run import entered, trial_run
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S
from mosaic_core.words.errors import DeviceGone, MosaicError, Refused

ABSENT = "/dev/mosaic-no-such-device"
NOWHERE = "mosaic-no-such-host.invalid"
"""RFC 2606 §2 promises that nobody ever has a name below ``invalid``; to be told so needs no network."""
BEGIN_S = 0.6
"""For a first message; a connector that waits for others sends none."""
SLOW_STOP_S = 1.0
"""What stops slower would take minutes to be restarted a hundred times."""
BRIEF_S = 0.05
"""The same for each of many restarts."""
SETTLE_S = 1.0
"""For threads that were told to end."""
CALM_S = 0.06
"""What has not changed for so long is not ending any more."""
LOOK_S = 0.01
_DEVICES = {"port", "device", "source", "path", "file", "camera_id"}
_HOSTS = {"host", "url", "broker", "server", "address"}


@dataclass(slots=True)
class Life:
    """Three runs of the same handlers, or one that did not end. ``failures``: each with the number of its run;
    ``stop_s``: the slowest end; ``stuck``: the lines at which bodies were that did not end."""

    failures: list[tuple[int, BaseException]] = field(default_factory=list)
    stop_s: float = 0.0
    stuck: list[CodePlace] = field(default_factory=list)

    @property
    def bugs(self) -> list[tuple[int, BaseException]]:
        """Failures that are no device's absence."""
        return [one for one in self.failures if not is_absence(one[1])]


def is_absence(error: BaseException) -> bool:
    """Whether an error says that a device is not there."""
    return isinstance(error, DeviceGone) or (isinstance(error, MosaicError) and error.code == "plugin.no_device")


_lives: WeakKeyDictionary[Examinee, Life] = WeakKeyDictionary()


async def lived(one: Examinee) -> Life:
    """The life of its handlers with the params of its trial, lived once. Raises :class:`NotJudged`."""
    if one in _lives:
        return _lives[one]
    _must_be_run(one)
    life, configured = Life(), one.configured(one.trial)
    async with entered(configured):
        for number in (1, 2, 3):
            async with trial_run(configured) as run:
                await run.begun(BEGIN_S if number == 1 else BRIEF_S)
            life.failures += [(number, error) for error in run.failures]
            life.stop_s = max(life.stop_s, run.stop_s)
            if life.stop_s >= STOP_PATIENCE_S:
                life.stuck = _lines_of_threads(one)
                break  # its thread is left behind, and another one would be
    _lives[one] = life
    return life


def _lines_of_threads(one: Examinee) -> list[CodePlace]:
    """Where the threads of its handlers are just now: the innermost line of its own code on each."""
    names = {f"mosaic-{handler.label}" for handler in one.handlers}
    idents = {thread.ident for thread in threading.enumerate() if thread.name in names}
    stacks = [frame for ident, frame in sys._current_frames().items() if ident in idents]
    places = (place_of_frames(traceback.extract_stack(frame), one.shipment.packages()) for frame in stacks)
    return list(dict.fromkeys(place for place in places if place.file))


def _must_be_run(one: Examinee) -> None:
    one.handlers  # noqa: B018 - raises where there is none
    for file in one.shipment.code():
        with contextlib.suppress(OSError, SyntaxError, ValueError):
            if _blocks(file.read_text("utf-8")):
                raise NotJudged("it would block this program too: mend blocks-nothing first")


@lru_cache(maxsize=MAX_FILES)
def _blocks(code: str) -> bool:
    """Asked of the same files for each connector of a distribution."""
    return any(blocking_lines(code))


async def leftovers(one: Examinee) -> list[str]:
    """What many restarts of whole robots leave behind, in words. Raises :class:`NotJudged`."""
    life = await lived(one)
    if life.bugs or life.stop_s > SLOW_STOP_S:
        raise NotJudged("it does not start and stop well: mend starts-again and hears-stop first")
    await _one_restart(one)  # what is made once for all is made now
    before = await _settled(None)
    for _ in range(one.restarts):
        await _one_restart(one)
    after = await _settled(before)
    return [
        f"{count} more {what}" for what, count in sorted((after - before).items()) if count >= max(2, one.restarts // 2)
    ]


async def _one_restart(one: Examinee) -> None:
    configured = one.configured(one.trial)
    async with entered(configured), trial_run(configured) as run:
        await run.begun(BRIEF_S)


async def _settled(wanted: Counter[str] | None) -> Counter[str]:
    """What is open once nothing ends any more; while it is more than ``wanted``, what is told to end may still do
    so."""
    gc.collect()
    found, since_s = Counter(_open_things()), time.monotonic()
    ends_at_s = since_s + SETTLE_S
    while (now_s := time.monotonic()) < ends_at_s:
        is_calm = now_s - since_s >= CALM_S
        if not found - wanted if wanted is not None else is_calm:
            break
        await asyncio.sleep(LOOK_S)
        if is_calm:
            gc.collect()  # what ended meanwhile may have left circles behind
        seen = Counter(_open_things())
        if seen != found or is_calm:
            found, since_s = seen, time.monotonic()
    return found


def _open_things() -> Iterator[str]:
    for thread in threading.enumerate():
        if thread.name.startswith("asyncio_"):
            continue  # of the event loop's own pool, which grows up to a bound
        yield f"threads like {thread.name.rstrip('0123456789-_')!r}"
    for task in asyncio.all_tasks():
        yield f"tasks like {task.get_name().rstrip('0123456789-_')!r}"
    with contextlib.suppress(OSError):  # where there is no /proc nothing is said of files
        for descriptor in Path("/proc/self/fd").iterdir():
            with contextlib.suppress(OSError):
                yield f"open files like {_kind_of(str(descriptor.readlink()))!r}"


def _kind_of(target: str) -> str:
    return target.partition(":")[0] if not target.startswith("/") else target


# -- a device that is not there --------------------------------------------------------------------------------------


async def absent_device_errors(one: Examinee) -> list[tuple[str, str, BaseException]]:
    """``(param, value, error)`` for each param of its example that names a device or a host, where none is; nothing
    where it runs without. Raises :class:`NotJudged`."""
    _must_be_run(one)
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
