"""Scans: compact for ours, the JSON that they know for original dashboards; only scans pass, whatever is sent."""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.messages import LaserScan
from mosaic_core.testing import FakeHost, build, fake_host
from mosaic_core.words.data_type import Delivery, MosaicDataType
from mosaic_core.words.errors import ConfigError, WireError
from mosaic_sensors.laser_scan import (
    LaserScanParams,
    LaserScanSender,
    Scan,
    decoded_scan,
    encoded_scan,
    json_of,
    scan_of,
    scan_of_json,
)
from mosaic_sensors.laser_scan.udp import LaserScanConfigurer, UdpLaserScan, read_scan

QUARTER = math.pi / 2
JSON_KEYS = {
    "angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max", "ranges",
    "intensities",
}  # fmt: skip


@given(
    st.lists(st.floats(0.01, 300) | st.just(math.nan) | st.just(math.inf) | st.just(0.0), max_size=80),
    st.booleans(),
)
def test_every_range_comes_back_within_half_a_step_and_no_return_as_none(ranges: list[float], deflate: bool) -> None:
    scan = scan_of(ranges, -1.5, 0.01, frame_id="laser", captured_at_s=7.25, scan_time_s=0.1)
    back = decoded_scan(encoded_scan(scan, deflate=deflate))
    longest = max([one for one in ranges if math.isfinite(one)], default=0.0)
    step_m = max(0.001, longest / 65_534)
    assert np.isnan(back.ranges_m).tolist() == np.isnan(scan.ranges_m).tolist()
    error = np.abs(back.ranges_m - scan.ranges_m)
    assert (np.isnan(error) | (error <= step_m / 2 + 4e-5)).all()
    assert (back.angle_min_rad, back.angle_increment_rad) == (-1.5, 0.01)
    assert (back.frame_id, back.captured_at_s, back.range_max_m) == ("laser", 7.25, math.inf)
    assert back.scan_time_s == pytest.approx(0.1)


def test_intensities_come_back_in_their_own_measure() -> None:
    scan = scan_of([1, 2, 3, 4], 0, QUARTER, intensities=[0.0, 1.0, 0.5, 0.25])
    back = decoded_scan(encoded_scan(scan)).intensities
    assert back is not None
    assert back.tolist() == pytest.approx([0, 1, 0.5, 0.25], abs=0.003)
    same = decoded_scan(encoded_scan(scan_of([1, 2], 0, 1, intensities=[7, 7]))).intensities
    assert same is not None
    assert same.tolist() == [7, 7]


def test_what_is_outside_of_the_range_is_no_return() -> None:
    scan = scan_of([0.05, 0.2, 31, -1, math.nan], 0, 1, range_min_m=0.1, range_max_m=30)
    assert np.isnan(scan.ranges_m).tolist() == [True, False, True, True, True]


def test_a_scan_of_1080_rays_takes_less_than_a_fifth_of_its_json() -> None:
    rng = np.random.default_rng(0)
    angles = np.linspace(-2.3, 2.3, 1080)
    ranges = np.minimum(10, 3 / np.maximum(np.abs(np.cos(angles)), 0.1)) + rng.normal(0, 0.01, 1080)
    scan = scan_of(ranges, -2.3, 4.6 / 1079, intensities=np.round(rng.random(1080), 2))
    assert len(encoded_scan(scan)) < len(json_of(scan)) / 5


def test_the_json_has_the_keys_of_original_dashboards_and_null_for_no_return() -> None:
    message = json.loads(json_of(scan_of([1.23456, math.nan], -1, 0.5, scan_time_s=0.1, intensities=[1, 2])))
    assert LaserScan.model_validate(message).model_dump(mode="json") == message
    assert set(message) == JSON_KEYS
    assert message["ranges"] == [1.235, None]
    assert (message["angle_max"], message["intensities"]) == (-0.5, [1, 2])
    again = scan_of_json(message)
    assert again.ranges_m[0] == pytest.approx(1.235)
    assert np.isnan(again.ranges_m[1])


@pytest.mark.parametrize(
    ("ranges", "more", "said"),
    [
        (np.zeros((2, 2)), {}, "shape"),
        (np.zeros(70_000), {}, "65535"),
        ([1, 2], {"intensities": [1]}, "intensities of shape"),
        ([1, 2], {"intensities": ["a", "b"]}, "intensities"),
        ([1], {"angle_min_rad": math.nan}, "finite"),
    ],
)
def test_what_is_no_scan_is_named(ranges: Any, more: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        scan_of(ranges, **{"angle_min_rad": 0.0, "angle_increment_rad": 0.1, **more})


GOOD = encoded_scan(scan_of(np.linspace(1, 9, 50), 0, 0.1, intensities=np.arange(50)), deflate=False)


@pytest.mark.parametrize(
    "data", [b"", GOOD[:40], GOOD[:-1], GOOD + b"x", b"MLS2" + GOOD[4:], GOOD[:4] + b"\x01" + GOOD[5:]]
)
def test_malformed_scans_are_refused(data: bytes) -> None:
    with pytest.raises(WireError):
        decoded_scan(data)


@given(st.binary(max_size=120))
def test_no_bytes_raise_anything_but_the_word_for_it(data: bytes) -> None:
    for whole in (data, GOOD[:58] + data):
        try:
            decoded_scan(whole)
        except WireError:
            continue


# -- senders -----------------------------------------------------------------------------------------------------


class Lidar(LaserScanSender):
    def scans(self) -> Iterator[Scan]:
        for _ in self.every(0.1):
            if self.monotonic_s() > 1000.35:
                return
            yield scan_of([1, 2, math.nan], 0, QUARTER)


def bound(params: LaserScanParams | None = None) -> tuple[Lidar, FakeHost]:
    lidar, host = Lidar("scan", params), FakeHost()
    lidar.bind(host)
    return lidar, host


def test_operators_of_ours_get_the_compact_form_and_original_ones_json() -> None:
    lidar, host = bound()
    assert list(lidar.messages()) == []
    assert len(host.sent) == 4
    sent = host.sent[0]
    assert (sent.kind, lidar.data_type, lidar.delivery) == (PayloadKind.BYTES, MosaicDataType.BYTE_R2U, Delivery.LATEST)
    assert decoded_scan(sent.payload).ranges_m[1] == 2
    assert sent.original_text is not None
    assert json.loads(sent.original_text())["ranges"] == [1, 2, None]


def test_json_for_all_is_the_users_choice() -> None:
    lidar, host = bound(LaserScanParams(form="json"))
    assert lidar.send_scan(scan_of([1], 0, 1))
    assert (host.sent[0].kind, host.sent[0].original_text) == (PayloadKind.STRING, None)
    assert json.loads(host.sent[0].payload)["ranges"] == [1]


def test_nothing_is_computed_for_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    lidar, host = bound()
    host.heard = set()
    monkeypatch.setattr("mosaic_sensors.laser_scan.sender.encoded_scan", lambda _: pytest.fail("computed"))
    assert not lidar.send_scan(scan_of([1], 0, 1))


@pytest.mark.parametrize(
    ("datagram", "said"),
    [
        (b"nonsense", "."),
        (b"[]", "object"),
        (b"{}", "ranges"),
        (b'{"ranges": [1], "angle_min": 0}', "angle_increment"),
        (b'{"ranges": 3, "angle_min": 0, "angle_increment": 1}', "no scan"),
        (b'{"ranges": ["a"], "angle_min": 0, "angle_increment": 1}', "."),
        (b'{"ranges": [[1]], "angle_min": 0, "angle_increment": 1}', "shape"),
        (b'{"ranges": [1], "angle_min": 0, "angle_increment": 1, "intensities": 5}', "."),
        (b"MLS1", "shorter"),
    ],
)
def test_a_datagram_that_is_no_scan_is_refused_with_the_cause(datagram: bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_scan(datagram, 0.0)


class SendingHost(FakeHost):
    def __init__(self, handler: UdpLaserScan, *datagrams: bytes) -> None:
        super().__init__()
        self._handler, self._datagrams, self._looks = handler, datagrams, 0

    @property
    def is_stopping(self) -> bool:
        if self._looks == 0:
            assert self._handler.datagrams.address is not None
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:
                for datagram in self._datagrams:
                    program.sendto(datagram, self._handler.datagrams.address)
        self._looks += 1
        return self._looks > len(self._datagrams)


def test_another_programs_scans_arrive_by_udp() -> None:
    handler = build(LaserScanConfigurer, label="scan", params={"source": "udp://127.0.0.1:0", "frame_id": "laser"})
    message = {"ranges": [1, None], "angle_min": 0, "angle_increment": 1}
    host = SendingHost(handler, b"no", json.dumps(message).encode(), encoded_scan(scan_of([3], 0, 1)))
    handler.bind(host)
    handler.messages()
    scans = [decoded_scan(one.payload) for one in host.sent]
    assert [(len(scan), scan.frame_id) for scan in scans] == [(2, "laser"), (1, "laser")]
    assert scans[1].captured_at_s == pytest.approx(host.clock.now_s)
    assert host.losses == {"refused": 1}


def test_an_address_that_is_none_is_refused_at_once() -> None:
    with pytest.raises(ConfigError, match="write udp://"):
        build(LaserScanConfigurer, params={"source": "/dev/ttyUSB0"})
    assert fake_host(build(LaserScanConfigurer, params={"source": "udp://127.0.0.1:9"})).sent == []
