"""What original dashboards get, read back with the official protobuf library and S2's message definitions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from google.protobuf import (  # type: ignore[import-untyped]
    descriptor_pb2,
    descriptor_pool,
    message_factory,
)
from hypothesis import given
from hypothesis import strategies as st

from mosaic_sensors.point_cloud import cloud_of
from mosaic_sensors.point_cloud.original_form import MAX_CHUNK_BYTES, POINTS_PER_CHUNK, OriginalForm, StreamMode

_TYPES = {"double": 1, "uint32": 13, "bool": 8, "string": 9, "bytes": 12}
POINT_FIELD = {1: "string name", 2: "uint32 offset", 3: "uint32 datatype", 4: "uint32 count"}
META = {
    1: "double timestamp", 2: "string frame_id", 3: "uint32 height", 4: "uint32 width", 5: "bool is_bigendian",
    6: "uint32 point_step", 7: "uint32 row_step", 8: "bool is_dense", 9: "double min_x", 10: "double max_x",
    11: "double min_y", 12: "double max_y", 13: "double min_z", 14: "double max_z", 15: "uint32 expected_chunk_num",
    16: "PointField fields",
}  # fmt: skip
CHUNK = {1: "double timestamp", 2: "string frame_id", 3: "uint32 chunk_index", 4: "uint32 point_size", 5: "bytes data"}
TIME_US = 1_763_700_000_123_456


def message_class(name: str) -> Any:
    return message_factory.GetMessageClass(_pool().FindMessageTypeByName(f"PointCloud.{name}"))


def _pool() -> Any:
    file = descriptor_pb2.FileDescriptorProto(name="pc.proto", package="PointCloud", syntax="proto3")
    for name, fields in (("PointField", POINT_FIELD), ("PCMeta", META), ("PCChunk", CHUNK)):
        message = file.message_type.add(name=name)
        for number, field in fields.items():
            kind, field_name = field.split()
            if kind in _TYPES:
                message.field.add(name=field_name, number=number, type=_TYPES[kind], label=1)
            else:
                message.field.add(name=field_name, number=number, type=11, label=3, type_name=f".PointCloud.{kind}")
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return pool


def read(messages: list[bytes]) -> tuple[Any, list[Any]]:
    return message_class("PCMeta").FromString(messages[0]), [
        message_class("PCChunk").FromString(message) for message in messages[1:]
    ]


def points_in(chunks: list[Any]) -> Any:
    return np.frombuffer(b"".join(chunk.data for chunk in chunks), dtype="<f4").reshape(-1, 4)


def line(count: int) -> Any:
    return np.stack([np.arange(count), np.zeros(count), -np.arange(count)], axis=1)


def test_the_meta_says_what_the_dashboards_stores_need() -> None:
    cloud = cloud_of([[0.0, -1, 2], [10, 1, 4]], intensity=[3.0, 7.0])
    meta, _ = read(OriginalForm().messages(cloud, TIME_US))
    assert (meta.timestamp, meta.height, meta.width, meta.is_bigendian) == (TIME_US, 1, 2, False)
    assert (meta.point_step, meta.row_step, meta.is_dense) == (16, 32, True)
    box = (meta.min_x, meta.max_x, meta.min_y, meta.max_y, meta.min_z, meta.max_z)
    assert box == pytest.approx((-1, 11, -1.2, 1.2, 1.8, 4.2))
    fields = [(one.name, one.offset, one.datatype, one.count) for one in meta.fields]
    assert fields == [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("intensity", 12, 7, 1)]


def test_colours_are_told_as_brightness_where_nothing_was_measured() -> None:
    rgb = [[255, 255, 255], [0, 0, 0], [255, 0, 0]]
    _, chunks = read(OriginalForm().messages(cloud_of(line(3), rgb=rgb), TIME_US))
    assert points_in(chunks)[:, 3] == pytest.approx([255, 0, 0.299 * 255])
    _, chunks = read(OriginalForm().messages(cloud_of(line(3), rgb=rgb, intensity=[7, 8, 9]), TIME_US))
    assert points_in(chunks)[:, 3].tolist() == [7, 8, 9]


@given(st.integers(0, 3 * POINTS_PER_CHUNK), st.sampled_from(["simple", "progressive"]))
def test_all_points_arrive_in_chunks_of_the_meta_that_are_not_too_large(count: int, mode: StreamMode) -> None:
    messages = OriginalForm(mode).messages(cloud_of(line(count), intensity=np.arange(count)), TIME_US)
    meta, chunks = read(messages)
    assert {chunk.frame_id for chunk in chunks} == {meta.frame_id}
    assert {chunk.timestamp for chunk in chunks} == {TIME_US}
    assert [chunk.chunk_index for chunk in chunks] == list(range(meta.expected_chunk_num))
    assert all(len(chunk.data) == 16 * chunk.point_size <= MAX_CHUNK_BYTES for chunk in chunks)
    assert sorted(points_in(chunks)[:, 3].tolist()) == list(range(count))


def test_a_store_that_counts_to_one_less_than_expected_has_the_whole_cloud() -> None:
    _, chunks = read(OriginalForm().messages(cloud_of(line(40_000)), TIME_US))
    assert len(points_in(chunks[:-1])) == 40_000
    assert chunks[-1].point_size == 0


def test_progressive_chunks_sample_the_whole_cloud_and_simple_ones_keep_its_order() -> None:
    cloud = cloud_of(line(40_000))
    _, progressive = read(OriginalForm("progressive").messages(cloud, TIME_US))
    _, simple = read(OriginalForm("simple").messages(cloud, TIME_US))
    assert all(np.ptp(points_in([chunk])[:, 0]) > 39_000 for chunk in progressive[:-1])
    assert points_in(simple)[:, 0].tolist() == list(range(40_000))


def test_the_box_grows_with_what_was_seen_and_every_cloud_has_a_name_of_its_own() -> None:
    form = OriginalForm()
    first, _ = read(form.messages(cloud_of([[0.0, 0, 0], [1, 1, 1]]), TIME_US))
    second, _ = read(form.messages(cloud_of([[5.0, 0, 0]]), TIME_US))
    third, _ = read(form.messages(cloud_of([]), TIME_US))
    assert (second.min_x, second.max_x) == (third.min_x, third.max_x) == pytest.approx((-0.5, 5.5))
    assert len({first.frame_id, second.frame_id, third.frame_id}) == 3


def test_the_bytes_are_those_that_the_official_library_writes() -> None:
    messages = OriginalForm().messages(cloud_of(line(300)), TIME_US)
    meta, chunks = read(messages)
    assert [one.SerializeToString(deterministic=True) for one in (meta, *chunks)] == messages
