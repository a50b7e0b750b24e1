"""Lives through starts and ends of a connector, and finds what went wrong in them and what is left over."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import re
import sys
import threading
import time
import traceback
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.handler import message_type_of
from mosaic_core.contract.message_schema import schema_of
from mosaic_core.contract.request_handler import RequestHandler
from mosaic_core.contract.units import unit_of
from mosaic_core.doctor.code_checks import blocking_lines
from mosaic_core.drill.commands import NoCommand, moving_command, nearest_to
from mosaic_core.drill.fields import put
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import NotJudged
from mosaic_core.ladder.shipment import MAX_FILES
from mosaic_core.ladder.source_places import place_of_frames
from mosaic_core.ladder.trial_run import TrialRun, entered, trial_run
from mosaic_core.runtime.configuration.auto_configurer import Configured
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S
from mosaic_core.words.errors import CodeLine, DeviceGone, MosaicError

BEGIN_S = 0.6
"""For a first message; a connector that waits for others sends none."""
SLOW_STOP_S = 1.0
"""What stops slower would take minutes to be restarted a hundred times."""
RESTARTS_S = 10.0
"""For all restarts; what stops slowly is restarted less often than it might be, but :data:`FEWEST_RESTARTS` times."""
FEWEST_RESTARTS = 10
BRIEF_S = 0.05
"""The same for each of many restarts."""
ANSWER_S = 0.3
"""For an answer; one that takes longer is taken back then."""
LONG_S = 10.0
"""So long it shall last what is asked for."""
SETTLE_S = 1.0
"""For threads that were told to end."""
CALM_S = 0.06
"""What has not changed for so long is not ending any more."""
LOOK_S = 0.01
_NUMBER = re.compile(r"[-_0-9]+(?= \(|$)")
"""What tells one thread or task from another of its kind, also as Python names them: ``Thread-3 (read)``."""


@dataclass(slots=True)
class Life:
    """Three runs of the same handlers, or one that did not end. ``failures``: each with the number of its run;
    ``stop_s``: the slowest end; ``stuck``: the lines at which bodies were that did not end."""

    failures: list[tuple[int, BaseException]] = field(default_factory=list)
    stop_s: float = 0.0
    stuck: list[CodeLine] = field(default_factory=list)

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
    must_be_run(one)
    life, configured = Life(), one.configured(one.trial)
    async with entered(configured):
        for number in (1, 2, 3):
            async with trial_run(configured) as run:
                await run.begun(BEGIN_S if number == 1 else BRIEF_S)
                if number == 1:
                    await _ask(one, run)
            life.failures += [(number, error) for error in run.failures]
            life.stop_s = max(life.stop_s, run.stop_s)
            if life.stop_s >= STOP_PATIENCE_S:
                life.stuck = _lines_of_threads(one)
                break  # its thread is left behind, and another one would be
    _lives[one] = life
    return life


async def _ask(one: Examinee, run: TrialRun) -> None:
    """Ask everything that answers a question, so that it may be answering when it shall stop. Only on a device that
    its author has made up: nobody knows what a question does to a real one."""
    if one.configurer.trial is None:
        return
    for handler in run.tried.handlers:
        if isinstance(handler, RequestHandler):
            with contextlib.suppress(NoCommand):
                await run.ask(handler.label, question_for(handler), ANSWER_S)


def question_for(handler: RequestHandler[Any, Any]) -> bytes:
    """A valid question that takes its time, where it says how long that shall be. Raises :class:`NoCommand`."""
    command = moving_command(handler, ReceiverSafety())
    wanted = message_type_of(type(handler))
    schema = schema_of(wanted) if is_model(wanted) else {}
    for name, said in schema.get("properties", {}).items():
        if said.get("type") == "number" and unit_of(name, said) == "s":
            put(command.message, name, nearest_to(LONG_S, said))
    return command.payload()


def _lines_of_threads(one: Examinee) -> list[CodeLine]:
    """Where the threads of its handlers are just now: the innermost line of its own code on each. An answer has a
    thread of its own, with its number."""
    names = {f"mosaic-{handler.label}" for handler in one.handlers}
    threads = [thread for thread in threading.enumerate() if thread.name.rstrip("0123456789").rstrip("-") in names]
    idents = {thread.ident for thread in threads}
    stacks = [frame for ident, frame in sys._current_frames().items() if ident in idents]
    places = (place_of_frames(traceback.extract_stack(frame), one.shipment.packages()) for frame in stacks)
    return list(dict.fromkeys(place for place in places if place.file))


def must_be_run(one: Examinee) -> None:
    """Raises :class:`NotJudged` where its code can't be run, or not without harm to this program."""
    one.handlers  # noqa: B018 - raises where there is none
    for file in one.shipment.code():
        with contextlib.suppress(OSError, SyntaxError, ValueError):
            if _blocks(file.read_text("utf-8")):
                raise NotJudged("it would block this program too: mend blocks-nothing first")


@lru_cache(maxsize=MAX_FILES)
def _blocks(code: str) -> bool:
    """Asked of the same files for each connector of a distribution."""
    return any(blocking_lines(code))


async def leftovers(one: Examinee) -> tuple[list[str], str]:
    """What many restarts leave behind, in words, and after which: of whole robots, else of the bodies of handlers that
    stay, for what a handler keeps goes with it. Raises :class:`NotJudged`."""
    life = await lived(one)
    if life.bugs or life.stop_s > SLOW_STOP_S:
        raise NotJudged("it does not start and stop well: mend starts-again and hears-stop first")
    restarts = restarts_of(one.restarts, life.stop_s)
    found = await _left_by(lambda: _one_restart(one), restarts)
    if found:
        return found, f"{restarts} restarts"
    restarts, configured = min(restarts, FEWEST_RESTARTS), one.configured(one.trial)
    async with entered(configured):
        return await _left_by(lambda: _one_run(configured), restarts), f"{restarts} restarts of the same handlers"


async def _left_by(restart: Callable[[], Awaitable[None]], restarts: int) -> list[str]:
    """What there is more of after so many, in words."""
    await restart()  # what is made once for all is made now
    before = await _settled(None)
    for _ in range(restarts):
        await restart()
    more = await _settled(before) - before
    return [f"{count} more {what}" for what, count in sorted(more.items()) if count >= max(2, restarts // 2)]


def restarts_of(wanted: int, stop_s: float) -> int:
    """How many of the restarts that are ``wanted`` there is time for, where each end takes ``stop_s``."""
    return min(wanted, max(FEWEST_RESTARTS, int(RESTARTS_S / max(stop_s, BRIEF_S))))


async def _one_restart(one: Examinee) -> None:
    configured = one.configured(one.trial)
    async with entered(configured):
        await _one_run(configured)


async def _one_run(configured: Configured) -> None:
    async with trial_run(configured) as run:
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
        yield f"threads like {_NUMBER.sub('', thread.name)!r}"
    for task in asyncio.all_tasks():
        yield f"tasks like {_NUMBER.sub('', task.get_name())!r}"
    with contextlib.suppress(OSError):  # where there is no /proc nothing is said of files
        for descriptor in Path("/proc/self/fd").iterdir():
            with contextlib.suppress(OSError):
                yield f"open files like {_kind_of(str(descriptor.readlink()))!r}"


def _kind_of(target: str) -> str:
    return target.partition(":")[0] if not target.startswith("/") else target
