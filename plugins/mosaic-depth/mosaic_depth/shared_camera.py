"""The one depth camera behind all connectors that name its source."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from mosaic_core import DeviceGone, Handler, Shared
from mosaic_depth.camera_registry import Opener, opener_of
from mosaic_depth.depth_camera import DepthCamera, DepthFrame, fault_of
from mosaic_depth.params import DepthCameraParams

WAIT_S = 0.5
"""How long a camera may wait for pictures, before its handlers look whether they shall stop."""
SILENCE_S = 6.0
"""A camera without one useful picture for so long is lost, though its driver still waits; one that starts takes 2 s."""
CURE = "check cable, power and permissions; it is tried again by itself"


class SharedDepthCamera:
    """Gives each handler the newest pictures it has not had yet; opened for the first, closed after the last.

    Whoever needs newer pictures reads them, while the others wait for the same ones: no thread of its own, and nothing
    is read that nobody wants.
    """

    def __init__(self, params: DepthCameraParams, opener: Opener | None = None) -> None:
        self.params = params
        self._open = opener or opener_of(params.kind)
        self._lock = threading.Lock()
        self._camera: DepthCamera | None = None
        self._users = 0
        self._number = 0
        self._latest: DepthFrame | None = None
        self._good_at_s = 0.0

    def __enter__(self) -> SharedDepthCamera:
        return self  # opens nothing: the robot starts without the camera, too

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._close()

    def frames(self, handler: Handler) -> Iterator[DepthFrame]:
        """Pictures, each with its time, until ``handler`` shall stop. On the handler's own thread. Raises
        :class:`DeviceGone`; the next call opens the camera anew. Pictures that are none are counted as refused."""
        seen = 0
        with self._used():
            while not handler.is_stopping:
                with self._lock:
                    if self._latest is None or self._number == seen:
                        self._read(handler)
                    frame, is_new, seen = self._latest, self._number != seen, self._number
                if frame is not None and is_new:
                    yield frame

    @contextmanager
    def _used(self) -> Iterator[None]:
        with self._lock:
            self._users += 1
        try:
            yield
        finally:
            with self._lock:
                self._users -= 1
                if not self._users:
                    self._close()

    def _read(self, handler: Handler) -> None:
        frame = self._taken(handler.monotonic_s)
        fault = "no picture" if frame is None else fault_of(frame)
        now_s = handler.monotonic_s()
        if frame is not None and not fault:
            captured_at_s = now_s if frame.captured_at_s is None else frame.captured_at_s
            self._latest = replace(frame, captured_at_s=captured_at_s)
            self._number += 1
            self._good_at_s = now_s
            return
        if frame is not None:
            handler.count_loss("refused")
        if now_s - self._good_at_s >= SILENCE_S:
            self._close()
            raise DeviceGone(f"the depth camera {self.params.source} gives {fault} for {SILENCE_S:g} s", CURE)

    def _taken(self, clock: Callable[[], float]) -> DepthFrame | None:
        try:
            if self._camera is None:
                self._camera = self._open(self.params)
                self._good_at_s = clock()
            return self._camera.next(WAIT_S)
        except OSError as error:
            self._close()
            raise DeviceGone(f"the depth camera {self.params.source}: {error.strerror or error}", CURE) from error
        except BaseException:
            self._close()
            raise

    def _close(self) -> None:
        camera, self._camera, self._latest = self._camera, None, None
        if camera is not None:
            with suppress(OSError):  # it is gone already
                camera.close()


def shared_camera(params: DepthCameraParams, shared: Shared) -> SharedDepthCamera:
    """The camera at ``params.source``, the same for all who ask. Raises :class:`MosaicError` (``config.invalid``)
    where two connectors describe it differently."""
    key, what = f"mosaic-depth:{params.source}", f"the depth camera {params.source}"
    return shared.agreed(key, lambda: SharedDepthCamera(params), params, what)
