"""A thread that keeps a device open while the robot runs, for those that are driven: the device is open, and told what
is safe, before the first command comes, and again when it comes back.

A device that is only read needs none: the body of its handler opens it, and begins anew when it is lost.
"""

from __future__ import annotations

import inspect
import logging
import threading
from collections.abc import Callable
from typing import Protocol

from mosaic_core.contract.declared.code_lines import code_of
from mosaic_core.contract.declared.wrong_declaration import called, wrong_call
from mosaic_core.machines.timing.backoff import Backoff, BackoffPolicy, again_in
from mosaic_core.words.errors import DeviceGone

_log = logging.getLogger(__name__)

PATIENCE_S = 1.0
"""A device that does not close in this time is abandoned: a robot shuts down within two seconds."""

RETRY = BackoffPolicy(first_s=0.5, max_s=5.0, jitter=0.0)
"""An adapter that is plugged in again is back within seconds, and nobody waits longer than five."""


class AbsenceListener(Protocol):
    """Hears whether a kept device is there. Any thread; neither blocks nor raises."""

    def away(self, gone: DeviceGone, tries_again_in_s: float) -> None: ...
    def is_back(self) -> None: ...


class Keeper:
    """Takes turns on a thread of its own, from :meth:`start` to :meth:`stop`.

    Make it with the thing that connectors share (:class:`~mosaic_core.Shared`), start it in ``__enter__``, which then
    neither fails nor blocks, and stop it in ``__exit__``. Handlers that drive the device name it as their ``keeper``:
    while it is away, so are they, and everybody is told as of a body that raises :class:`~mosaic_core.DeviceGone`.
    """

    def __init__(
        self, name: str, turn: Callable[[], float | None], leave: Callable[[], object] | None = None,
        patience_s: float = PATIENCE_S, retry: BackoffPolicy = RETRY,
    ) -> None:  # fmt: skip
        """``name``: of the thread. ``turn``: opens what is not open, or does one piece of work, and returns the seconds
        until the next turn, ``None``: until :meth:`wake`. Raising :class:`~mosaic_core.DeviceGone` it says that the
        device is away; what else it raises is logged; it is called again in both cases. ``leave``: on the thread, after
        the last turn. ``patience_s``: how long :meth:`stop` waits for both. ``retry``: waits after failures. Raises
        :class:`MosaicError` (``config.broken_plugin``) for what is none of these."""
        _check_made_of(name, turn, leave)
        self._name = name
        self._turn = turn
        self._leave = leave
        self._patience_s = patience_s
        self._backoff = Backoff(retry)
        self._thread: _KeeperThread | None = None
        self._listeners: list[AbsenceListener] = []
        self._absence_lock = threading.Lock()
        self.absence: DeviceGone | None = None
        """Why the device is away, as far as anybody has noticed. Any thread."""
        self.failures = 0
        """Since the device was there last."""
        self._has_worked = False
        self._bug = ""

    def start(self) -> None:
        """Begin to take turns. Never blocks."""
        self._thread = _KeeperThread(self._name, self._turn, self._leave, self)
        self._thread.start()

    def stop(self) -> None:
        """No turn after this one. Waits for it, and abandons a thread that hangs: it takes no other turn, not even
        when the keeper is started again."""
        thread = self._thread
        if thread is None:
            return
        thread.is_over = True
        thread.news.set()
        thread.join(self._patience_s)
        if thread.is_alive():
            _log.error("%s did not close within %s s and was abandoned", self._name, self._patience_s)

    def failed(self) -> float:
        """For a turn that could not do its work: the seconds until the next attempt, by default twice those before,
        from half a second to five."""
        self.failures += 1
        return self._backoff.failed(0.0, 0.0)

    def away(self, gone: DeviceGone) -> float:
        """As :meth:`failed`, of a device that is not there; a turn may raise ``gone`` instead."""
        wait_s = self.failed()
        self._tell_away(gone, wait_s)
        return wait_s

    def broke(self, error: Exception) -> float:
        """As :meth:`failed`, of a turn with a bug or an error that its author did not foresee, which is told once, with
        the traceback. A device that was not open before is away."""
        wait_s, said = self.failed(), f"{type(error).__name__}: {error}"
        hint = "; if the device may be away, raise DeviceGone from it" if isinstance(error, OSError) else ""
        level = logging.ERROR if said != self._bug else logging.DEBUG
        self._bug = said
        told = (self._name, said, hint, again_in(wait_s))
        _log.log(level, "%s: a turn failed: %s%s; the next one comes %s", *told, exc_info=error)
        if not self._has_worked or self.absence is not None:
            gone = DeviceGone(f"{self._name} could not be opened: {said}")
            if not isinstance(error, OSError):
                gone.code = "plugin.failed"  # whoever reads the other one looks for a cable
            self._tell_away(gone, wait_s, is_told=True)
        return wait_s

    def worked(self) -> None:
        """The device is there: the next failure is a first one again. A turn that returns without having :meth:`failed`
        says so by that, unless the device was :meth:`lost` meanwhile."""
        self.failures = 0
        self._has_worked, self._bug = True, ""
        self._backoff.reset()
        if self.absence is not None:
            self._tell_back()

    def lost(self, gone: DeviceGone) -> None:
        """Whoever used the device has found it gone: the next turn, which opens it, comes now. Any thread. A
        ``handle_data`` whose handler names this keeper need only raise ``gone``."""
        if self.absence is None:
            self._tell_away(gone, 0.0)
            self.wake()

    def listen(self, listener: AbsenceListener) -> None:
        """Tell it of each failed attempt, and when the device is back. Any thread."""
        with self._absence_lock:
            self._listeners.append(listener)
            if self.absence is not None:
                listener.away(self.absence, 0.0)

    def ignore(self, listener: AbsenceListener) -> None:
        """Tell it no more. Any thread."""
        with self._absence_lock:
            self._listeners.remove(listener)

    def _tell_away(self, gone: DeviceGone, tries_again_in_s: float, *, is_told: bool = False) -> None:
        with self._absence_lock:
            is_news = self.absence is None or str(self.absence) != str(gone)
            self.absence = _alone(gone)
            for one in self._listeners:
                one.away(gone, tries_again_in_s)
            if is_news and not self._listeners and not is_told:
                _log.warning("%s: %s; tries again %s", self._name, self.absence, again_in(tries_again_in_s))

    def _tell_back(self) -> None:
        with self._absence_lock:
            self.absence = None
            for one in self._listeners:
                one.is_back()
            if not self._listeners:
                _log.info("%s: the device is back", self._name)

    def wake(self) -> None:
        """Take the next turn, or end a :meth:`wait`, now. Any thread."""
        thread = self._thread
        if thread is not None:
            thread.news.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait within a turn, until :meth:`wake` or :meth:`stop`, or so long; ``True`` when it shall end."""
        thread = self._current()
        if thread is None:
            return True
        thread.wait(seconds)
        return thread.is_over

    @property
    def is_stopping(self) -> bool:
        """Whether this was stopped, or not started yet; on a thread of its own, whether that one shall end."""
        thread = self._current()
        return thread is None or thread.is_over

    def is_taken_by(self, thread: threading.Thread) -> bool:
        """Whether no other thread takes its turns since."""
        return self._thread is thread

    def _current(self) -> _KeeperThread | None:
        """The thread that asks, if it is, or was, this keeper's; else the one that takes turns now."""
        asking = threading.current_thread()
        return asking if isinstance(asking, _KeeperThread) and asking.keeper is self else self._thread


def _check_made_of(name: object, turn: object, leave: object) -> None:
    """Refuse what can't be called, or would run nothing, and a name that is none."""
    if not isinstance(name, str):
        cure = "Write Keeper(name, turn): the name first, then the method that takes a turn."
        raise wrong_call(f"Keeper(…) got {called(name)} in place of its name.", cure)
    for what, given in (("turn", turn), ("leave", leave)):
        if given is None and what == "leave":
            continue
        if not callable(given):
            cure = f"Name the method without brackets: self.{what}, not self.{what}()."
            raise wrong_call(f"Keeper({name!r}, …) got {called(given)} in place of a {what}.", cure)
        if inspect.iscoroutinefunction(given) or inspect.isgeneratorfunction(given):
            cure = "Write it as a plain `def`: it runs on a thread of its own, and may block."
            raise wrong_call(
                f"the {what} of Keeper({name!r}, …) is async or yields, and nothing of it would run.", cure
            )


def _alone(gone: DeviceGone) -> DeviceGone:
    """The same words, to be kept: without a traceback and a cause, which keep what was half opened."""
    copy = DeviceGone(gone.message)
    copy.cure, copy.code = gone.cure, gone.code
    return copy


class _KeeperThread(threading.Thread):
    def __init__(
        self, name: str, turn: Callable[[], float | None], leave: Callable[[], object] | None, keeper: Keeper
    ) -> None:
        super().__init__(name=name, daemon=True)
        self.keeper = keeper
        self._turn = turn
        self._leave = leave
        self.is_over = False
        self.news = threading.Event()

    def run(self) -> None:
        try:
            while not self.is_over:
                self._take()
        finally:
            if self._leave is not None and self.keeper.is_taken_by(self):
                self._leave()

    def _take(self) -> None:
        pause_s = self._failed()
        if pause_s is not None:
            self.wait(pause_s)  # not where the error is still known: it would keep a device that was half opened

    def _failed(self) -> float | None:
        """One turn and its rest; the pause where it failed. What is wrong with it is told, and another one tries again:
        a device shall not be given up for it."""
        failures, absence = self.keeper.failures, self.keeper.absence
        try:
            rest_s = self._turn()
            if not isinstance(rest_s, int | float | None):
                what = f"a turn returns the seconds until the next one, or None, and not {rest_s!r}"
                raise TypeError(f"{code_of(self._turn).heading}{what}")
            if self.keeper.failures == failures and self.keeper.absence in (None, absence):
                self.keeper.worked()
            self.wait(rest_s)
        except DeviceGone as gone:
            return self.keeper.away(gone)
        except Exception as error:  # noqa: BLE001 - code of a plugin may raise anything, and return what is no time
            return self.keeper.broke(error)
        return None

    def wait(self, seconds: float | None) -> None:
        if not self.is_over:
            self.news.wait(seconds)
        self.news.clear()
