"""Point clouds for original dashboards: protobuf messages Meta and Chunk as the S2 dashboard reads them.

Two small messages of scalars: written by hand, they need no generated code and no protobuf on the robot; the tests read
them with the official library.
"""

from __future__ import annotations

import struct
import uuid
from typing import Literal, TypeAlias

import numpy as np

from mosaic_sensors.point_cloud.cloud import Floats, PointCloud

StreamMode: TypeAlias = Literal["simple", "progressive"]

POINT_STEP = 16
"""x, y, z, intensity as float32: the four that the dashboard's stores insist on."""
MAX_CHUNK_BYTES = 240 * 1024
POINTS_PER_CHUNK = MAX_CHUNK_BYTES // POINT_STEP
_FLOAT32 = 7
"""ROS' code of the type in a PointField."""
_MARGIN = 0.1
"""The bounding box is widened by this share of its length on each side."""
_LUMA = np.array([0.299, 0.587, 0.114], dtype="<f4")
"""The brightness of a colour (ITU-R BT.601): original dashboards know no colours of points."""
_VARINT, _FIXED64, _BYTES = 0, 1, 2


class OriginalForm:
    """Writes the clouds of one connector for original dashboards: the bounding box grows with what has been seen, so
    that colours by height stay put.
    """

    def __init__(self, stream_mode: StreamMode = "progressive") -> None:
        self._stream_mode = stream_mode
        self._low: Floats | None = None
        self._high: Floats | None = None

    def messages(self, cloud: PointCloud, wall_time_us: int) -> list[bytes]:
        """The Meta, then its Chunks: all points, in ``progressive`` mode each chunk a sample of the whole cloud.

        Last comes a chunk without points. Original stores show a cloud when one chunk less has arrived than the Meta
        announces; so they have it whole, whether they do so or wait for all.
        """
        frame_id = str(uuid.uuid4())
        records = self._records(cloud)
        count = -(-len(records) // POINTS_PER_CHUNK)
        if self._stream_mode == "progressive":
            parts = [records[index::count] for index in range(count)]
        else:
            parts = [records[at : at + POINTS_PER_CHUNK] for at in range(0, len(records), POINTS_PER_CHUNK)]
        parts.append(records[:0])
        meta = self._meta(wall_time_us, frame_id, len(records), len(parts))
        return [meta, *(_chunk(wall_time_us, frame_id, index, part) for index, part in enumerate(parts))]

    def _records(self, cloud: PointCloud) -> Floats:
        records = np.zeros((len(cloud), 4), dtype="<f4")
        records[:, :3] = cloud.xyz
        if cloud.intensity is not None:
            records[:, 3] = np.nan_to_num(cloud.intensity)
        elif cloud.rgb is not None:
            records[:, 3] = cloud.rgb @ _LUMA
        if len(cloud):
            low, high = cloud.xyz.min(axis=0), cloud.xyz.max(axis=0)
            self._low = low if self._low is None else np.minimum(self._low, low)
            self._high = high if self._high is None else np.maximum(self._high, high)
        return records

    def _meta(self, wall_time_us: int, frame_id: str, points: int, chunks: int) -> bytes:
        low, high = (np.zeros(3) if box is None else box for box in (self._low, self._high))
        margin = (high - low) * _MARGIN
        box = [bound for axis in range(3) for bound in (low[axis] - margin[axis], high[axis] + margin[axis])]
        return b"".join((
            _double(1, wall_time_us), _bytes(2, frame_id.encode()),
            _uint(3, 1), _uint(4, points), _uint(6, POINT_STEP), _uint(7, POINT_STEP * points), _uint(8, 1),
            *(_double(number, float(bound)) for number, bound in enumerate(box, start=9)),
            _uint(15, chunks),
            *(_bytes(16, _field(name, 4 * index)) for index, name in enumerate(("x", "y", "z", "intensity"))),
        ))  # fmt: skip


def _chunk(wall_time_us: int, frame_id: str, index: int, records: Floats) -> bytes:
    return b"".join((
        _double(1, wall_time_us), _bytes(2, frame_id.encode()),
        _uint(3, index), _uint(4, len(records)), _bytes(5, records.tobytes()),
    ))  # fmt: skip


def _field(name: str, offset: int) -> bytes:
    return _bytes(1, name.encode()) + _uint(2, offset) + _uint(3, _FLOAT32) + _uint(4, 1)


# Proto3 leaves out what has its type's default value.


def _uint(number: int, value: int) -> bytes:
    return _varint(number << 3 | _VARINT) + _varint(value) if value else b""


def _double(number: int, value: float) -> bytes:
    return _varint(number << 3 | _FIXED64) + struct.pack("<d", value) if value else b""


def _bytes(number: int, value: bytes) -> bytes:
    return _varint(number << 3 | _BYTES) + _varint(len(value)) + value if value else b""


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)
