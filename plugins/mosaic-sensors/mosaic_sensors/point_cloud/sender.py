"""The base of every point cloud connector: whatever yields arrays becomes a sender of filtered, quantized clouds.

All the work is done on the handler's own thread (or on the one that pushes), once per cloud whatever the number of
operators, and only in the forms that somebody listens to.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import closing, nullcontext
from typing import Any, ClassVar

from mosaic_core.contract.handler import DataChannelSendable, Handler
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES
from mosaic_core.machines.timing.pacing import GridThinning
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.cloud_filter import filtered, sampled
from mosaic_sensors.point_cloud.compact_form import encoded
from mosaic_sensors.point_cloud.deflation import Deflation
from mosaic_sensors.point_cloud.original_form import OriginalForm
from mosaic_sensors.point_cloud.params import PointCloudParams

_FITTING_SHARE = 0.9
"""A cloud that is too large for one message is thinned to this share of what would just fit."""


class OriginalChannel(DataChannelSendable[bytes]):
    """A channel on which original dashboards expect point clouds."""

    is_for_originals = True


class PointCloudSender(DataChannelSendable[bytes]):
    """Derive from it and write :meth:`clouds`, or push with :meth:`send_points` from any thread::

        class DepthCamera(PointCloudSender):
            def clouds(self):
                with opened_camera() as camera:
                    while not self.is_stopping:
                        yield camera.points()          # (n, 3) metres, (n, 4) with intensity, or structured


        class DepthCameraConfigurer(DataChannelConfigurer[PointCloudParams]):
            connector_type = "acme-depth"

            def configure(self):
                return DepthCamera(self.label, self.params).handlers()

    Operators that can't keep up get the newest cloud and no queue of old ones.
    """

    runs = "watched"
    widget: ClassVar[str | None] = "point-cloud"
    delivery: ClassVar[Delivery | DeliveryContract] = DeliveryContract(
        mode=Delivery.BULK, queue_messages=1, newest_wins=True, latch=True
    )

    def __init__(self, label: str, params: PointCloudParams | None = None) -> None:
        super().__init__(label)
        self.cloud_params = params or PointCloudParams()
        self.originals = tuple(OriginalChannel(f"{label}-{number}") for number in range(self.cloud_params.parallel_num))
        self._deflation = Deflation(self.cloud_params.compress)
        self._original_form = OriginalForm(self.cloud_params.stream_mode)
        self._pace = GridThinning(self.cloud_params.max_rate_hz, slack=0.5)
        self._lock = threading.Lock()

    def clouds(self) -> Iterable[Any]:
        """Yield arrays as :func:`~mosaic_sensors.point_cloud.cloud.cloud_of` takes them, its clouds, or functions that
        make one of both, called only for a cloud whose turn it is. Runs on a thread of its own, only while somebody
        watches."""
        return ()

    def handlers(self) -> Sequence[Handler]:
        """What ``configure()`` returns: this and its channels for original dashboards."""
        return (self, *self.originals)

    @property
    def is_heard(self) -> bool:
        """Whether anybody watches, with a dashboard of ours or an original one. Any thread."""
        return super().is_heard or self._original_channel() is not None

    def send_points(
        self,
        xyz: Any,
        intensity: Any = None,
        rgb: Any = None,
        frame_id: str = "",
        captured_at_s: float | None = None,
    ) -> bool:
        """Send one cloud now; ``captured_at_s`` is of the robot's monotonic clock.

        ``False``: nobody watches, it comes before its turn (``max_rate_hz``), or every operator's queue is full.
        Raises :class:`ValueError` where the arrays don't fit together. Any thread; takes as long as filtering and
        encoding, a few milliseconds per 100 000 points.
        """
        if not self._is_due():
            return False
        return self._sent(cloud_of(xyz, intensity=intensity, rgb=rgb, frame_id=frame_id, captured_at_s=captured_at_s))

    def messages(self) -> Iterator[bytes]:
        """The clouds of :meth:`clouds`, in the compact form."""
        stream = iter(self.clouds())
        with closing(stream) if isinstance(stream, Generator) else nullcontext():
            for item in stream:
                if not self._is_due():
                    continue
                made = item() if callable(item) else item
                data = self._made(made if isinstance(made, PointCloud) else cloud_of(made))
                if data is not None:
                    yield data

    def _sent(self, cloud: PointCloud) -> bool:
        was_original_sent = self._original_channel() is not None
        data = self._made(cloud)
        return self.send_bytes(data) if data is not None else was_original_sent

    def _is_due(self) -> bool:
        with self._lock:
            if not self.is_heard:
                return False
            is_due = self._pace.takes(self.monotonic_s())
            if not is_due:
                self.count_loss("thinned")
            return is_due

    def _made(self, cloud: PointCloud) -> bytes | None:
        """The compact form, if somebody hears it; the original one is sent from here."""
        with self._lock:
            stays = filtered(cloud, self.cloud_params)
            channel = self._original_channel()
            if channel is not None:
                channel.send_burst(self._original_form.messages(stays, self._wall_time_us(cloud)))
            return self._compact(stays) if super().is_heard else None

    def _original_channel(self) -> OriginalChannel | None:
        """All of a cloud travels on one channel: a Meta must come before its Chunks, and only one channel keeps that
        order. The dashboard reads all of them alike."""
        return next((channel for channel in self.originals if channel.is_heard), None)

    def _wall_time_us(self, cloud: PointCloud) -> int:
        age_s = 0.0 if cloud.captured_at_s is None else self.monotonic_s() - cloud.captured_at_s
        return time.time_ns() // 1000 - int(age_s * 1e6)

    def _compact(self, cloud: PointCloud) -> bytes:
        while True:
            data = self._encoded(cloud)
            if len(data) <= MAX_MESSAGE_BYTES:
                return data
            cloud = sampled(cloud, int(len(cloud) * _FITTING_SHARE * MAX_MESSAGE_BYTES / len(data)))

    def _encoded(self, cloud: PointCloud) -> bytes:
        form = encoded(cloud, self.cloud_params.resolution_m)
        size_bytes = len(form.body)
        if not self._deflation.pays(size_bytes):
            return form.plain()
        start_s = time.thread_time()  # a busy computer makes the sending dearer too
        deflated = form.deflated()
        self._deflation.note(size_bytes, len(deflated), time.thread_time() - start_s)
        return deflated if self._deflation.keeps(size_bytes, len(deflated)) else form.plain()
