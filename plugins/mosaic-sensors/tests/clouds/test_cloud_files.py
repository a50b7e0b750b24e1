"""PLY, PCD, NPY and NPZ in all their forms; a broken or hostile file is told with its name and the cause."""

from __future__ import annotations

import contextlib
import io
import logging
import random
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core import DeviceGone
from mosaic_sensors.point_cloud.cloud_files import CloudFiles, cloud_paths, read_cloud
from mosaic_sensors.point_cloud.file_bytes import CloudFileError
from mosaic_sensors.point_cloud.lzf import lzf_decompressed

XYZ = [[0.5, -1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]
GREY = [[10, 20, 30], [40, 50, 60], [70, 80, 90]]
PLY_HEADER = """ply
format {form} 1.0
comment made by hand
element vertex 3
property float x
property float y
property double z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
"""
PCD_HEADER = """# .PCD v0.7
VERSION 0.7
FIELDS x y z _ intensity
SIZE 4 4 4 1 2
TYPE F F F U U
COUNT 1 1 1 4 1
WIDTH 3
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 3
DATA {form}
"""


def ply(form: str) -> bytes:
    header = PLY_HEADER.format(form=form).encode()
    if form == "ascii":
        rows = [" ".join(map(str, [*xyz, *rgb])) for xyz, rgb in zip(XYZ, GREY, strict=True)]
        return header + "\n".join(rows).encode() + b"\n3 0 1 2\n"
    order = "<" if "little" in form else ">"
    rows_ = [struct.pack(f"{order}ffdBBB", *xyz, *rgb) for xyz, rgb in zip(XYZ, GREY, strict=True)]
    return header + b"".join(rows_) + struct.pack(f"{order}Biii", 3, 0, 1, 2)


def literal_lzf(data: bytes) -> bytes:
    """Valid LZF that copies everything."""
    return b"".join(bytes((len(data[at : at + 32]) - 1,)) + data[at : at + 32] for at in range(0, len(data), 32))


def pcd(form: str) -> bytes:
    header = PCD_HEADER.format(form=form).encode()
    if form == "ascii":
        return header + "\n".join(f"{x} {y} {z} 0 0 0 0 {i}" for i, (x, y, z) in enumerate(XYZ, 5)).encode()
    if form == "binary":
        return header + b"".join(struct.pack("<fff4xH", *xyz, i) for i, xyz in enumerate(XYZ, 5))
    columns = [struct.pack("<3f", *column) for column in zip(*XYZ, strict=True)]
    fields = b"".join([*columns, bytes(12), struct.pack("<3H", 5, 6, 7)])
    packed = literal_lzf(fields)
    return header + struct.pack("<II", len(packed), len(fields)) + packed


def npz(**arrays: Any) -> bytes:
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    return out.getvalue()


def npy(array: Any) -> bytes:
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def read(tmp_path: Path, name: str, data: bytes) -> Any:
    path = tmp_path / name
    path.write_bytes(data)
    return read_cloud(path)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_of_every_form(tmp_path: Path, form: str) -> None:
    cloud = read(tmp_path, "a.ply", ply(form))
    assert cloud.xyz.tolist() == XYZ
    assert cloud.rgb.tolist() == GREY


def test_ply_with_the_line_ends_of_windows(tmp_path: Path) -> None:
    assert read(tmp_path, "a.ply", ply("ascii").replace(b"\n", b"\r\n")).xyz.tolist() == XYZ


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_pcd_of_every_form(tmp_path: Path, form: str) -> None:
    cloud = read(tmp_path, "a.PCD", pcd(form))
    assert cloud.xyz.tolist() == XYZ
    assert cloud.intensity.tolist() == [5, 6, 7]


def test_pcd_without_points_takes_width_and_height(tmp_path: Path) -> None:
    assert read(tmp_path, "a.pcd", pcd("ascii").replace(b"POINTS 3\n", b"")).xyz.tolist() == XYZ


def test_npy_and_npz(tmp_path: Path) -> None:
    assert read(tmp_path, "a.npy", npy(np.array(XYZ, ">f4"))).xyz.tolist() == XYZ
    assert read(tmp_path, "b.npy", npy(np.asfortranarray(XYZ))).xyz.tolist() == XYZ
    cloud = read(tmp_path, "c.npz", npz(points=np.array(XYZ), intensity=np.arange(3), colors=np.array(GREY, np.uint8)))
    assert (cloud.xyz.tolist(), cloud.intensity.tolist(), cloud.rgb.tolist()) == (XYZ, [0, 1, 2], GREY)
    assert read(tmp_path, "d.npz", npz(anything=np.array(XYZ))).xyz.tolist() == XYZ


def test_lzf_repeats_what_it_has_just_written() -> None:
    assert lzf_decompressed(b"\x00a" + b"\xe0\x05\x00", 15) == b"a" * 15
    assert lzf_decompressed(b"\x02abc" + b"\x40\x02", 7) == b"abcabca"
    for bad in (b"\x00", b"\x20", b"\x20\x00", b"\x00a\xe0", b"\x00a\x20\x05", b"\x05abc"):
        with pytest.raises(ValueError, match="compressed data"):
            lzf_decompressed(bad, 3)


BAD = [
    ("a.ply", b"play\n", "doesn't begin with 'ply'"),
    ("a.ply", b"ply\nformat ascii 1.0\n", "no line 'end_header'"),
    ("a.ply", ply("ascii").replace(b"ascii", b"morse"), "format 'morse'"),
    ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex 99999999999"), "are the most"),
    ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex -3"), "not a number"),
    ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex 9"), "can't be read|ends after"),
    ("a.ply", ply("ascii").replace(b"element vertex 3", b"element edge 3"), "first element is 'edge'"),
    ("a.ply", ply("ascii").replace(b"float x", b"list uchar int x"), "is no property"),
    ("a.ply", ply("ascii").replace(b"float x", b"float q"), "no field x"),
    ("a.ply", ply("ascii").replace(b"3.0 4.0", b"3.0 four"), "can't be read"),
    ("a.ply", ply("binary_little_endian").replace(b"vertex 3", b"vertex 30000000"), "it ends after 3 of 30000000"),
    ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
    ("a.pcd", b"FIELDS x y z\n", "no line 'DATA'"),
    ("a.pcd", pcd("ascii").replace(b"SIZE 4 4", b"SIZE 4"), "different numbers"),
    ("a.pcd", pcd("ascii").replace(b"SIZE 4 4", b"SIZE 4 3"), "which is no number"),
    ("a.pcd", pcd("ascii").replace(b"COUNT 1 1 1 4", b"COUNT 1 1 1 9999"), "COUNT of '_'"),
    ("a.pcd", pcd("ascii").replace(b"DATA ascii", b"DATA zip"), "DATA is 'zip'"),
    ("a.pcd", pcd("binary")[:-1], "it ends after 2 of 3 points"),
    ("a.pcd", pcd("binary").replace(b"WIDTH 3", b"WIDTH").replace(b"POINTS 3\n", b""), "neither POINTS nor WIDTH"),
    ("a.pcd", pcd("binary_compressed")[:-1], "compressed bytes"),
    ("a.pcd", pcd("binary_compressed").replace(b"POINTS 3", b"POINTS 4"), "announces"),
    ("a.npy", b"\x93NUMPY", "its header can't be read"),
    ("a.npy", npy(np.array(XYZ))[:-1], "it ends after"),
    ("a.npy", npy(np.array(XYZ)).replace(b"(3, 3)", b"(300000000, 3)"), "header can't be read|it ends after"),
    ("a.npy", npy(np.array([[{}]], dtype=object)), "Python objects"),
    ("a.npz", b"PK nothing", "no archive"),
    ("a.npz", npz(one=np.zeros(3), two=np.zeros(3)), "it has one, two"),
    ("a.xyz", b"", "'.xyz' is none of .ply, .pcd"),
]


@pytest.mark.parametrize(("name", "data", "cause"), BAD)
def test_a_bad_file_is_told_with_its_name_and_the_cause(tmp_path: Path, name: str, data: bytes, cause: str) -> None:
    with pytest.raises(CloudFileError, match=f"{name}.*({cause})"):
        read(tmp_path, name, data)


def test_an_archive_that_unpacks_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as member:
        for _ in range(520):
            member.write(bytes(1 << 20))
    with pytest.raises(CloudFileError, match="unpacks to"):
        read_cloud(path)


@pytest.mark.parametrize("kind", [">f8", "<f8"])
def test_doubles_stay_doubles_in_either_byte_order(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "far.npy"
    path.write_bytes(npy(np.array([[1e9 + 0.125, 1e300, 0.0]], dtype=kind)))
    assert read_cloud(path).xyz.tolist() == [[1e9 + 0.125, 1e300, 0.0]]


GOOD = [("f.ply", ply("ascii")), ("f.ply", ply("binary_big_endian")), ("f.pcd", pcd("ascii")), ("f.pcd", pcd("binary"))]
GOOD += [("f.pcd", pcd("binary_compressed")), ("f.npy", npy(np.array(XYZ))), ("f.npz", npz(points=np.array(XYZ)))]


@given(st.sampled_from(GOOD), st.integers(0, 2**32))
def test_no_damage_raises_anything_but_the_word_for_it(
    tmp_path_factory: Any, good: tuple[str, bytes], seed: int
) -> None:
    name, data = good
    chance = random.Random(seed)
    damaged = bytearray(data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data)
    for _ in range(chance.randrange(4) if damaged else 0):
        damaged[chance.randrange(len(damaged))] = chance.randrange(256)
    path = tmp_path_factory.getbasetemp() / name
    path.write_bytes(damaged)
    with contextlib.suppress(CloudFileError):
        read_cloud(path)


def test_a_folder_and_a_pattern_play_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        (tmp_path / f"scan_{number}.npy").write_bytes(npy(np.full((1, 3), float(number))))
    (tmp_path / "notes.txt").write_text("no cloud")
    for source in (str(tmp_path), str(tmp_path / "scan_*.npy")):
        assert [cloud.xyz[0, 0] for cloud in CloudFiles(source).one_pass()] == [1, 2, 10]
    assert cloud_paths(str(tmp_path / "scan_1.npy")) == [tmp_path / "scan_1.npy"]


def test_a_file_that_cannot_be_read_is_left_out_and_told_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "a.npy").write_bytes(npy(np.zeros((1, 3))))
    (tmp_path / "b.npy").write_bytes(b"broken")
    files = CloudFiles(str(tmp_path))
    with caplog.at_level(logging.WARNING):
        assert [len(list(files.one_pass())) for _ in range(3)] == [1, 1, 1]
    assert [record.getMessage().count("b.npy") for record in caplog.records] == [1]
    (tmp_path / "a.npy").write_bytes(b"broken too")
    with pytest.raises(CloudFileError, match=r"b\.npy"):
        list(CloudFiles(str(tmp_path)).one_pass())


def test_nothing_to_play_is_said(tmp_path: Path) -> None:
    with pytest.raises(DeviceGone, match="no file with one of the endings"):
        cloud_paths(str(tmp_path))
    with pytest.raises(DeviceGone, match="no file"):
        cloud_paths(str(tmp_path / "*.ply"))
    with pytest.raises(DeviceGone, match=r"gone\.ply"):
        list(CloudFiles(str(tmp_path / "gone.ply")).one_pass())
