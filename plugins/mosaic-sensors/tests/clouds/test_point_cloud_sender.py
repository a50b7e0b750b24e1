"""From whatever yields arrays to what operators get: thinned once, in the forms that somebody hears, at its rate."""

from __future__ import annotations

import re
import socket
import time
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES
from mosaic_core.testing import FakeHost, build, collect, fake_host
from mosaic_core.words.data_type import Delivery, MosaicDataType
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.point_cloud import PointCloudParams, PointCloudSender, cloud_of, decoded
from mosaic_sensors.point_cloud.connector import PointCloudConfigurer
from mosaic_sensors.point_cloud.datagrams import Assembly, datagrams_of
from mosaic_sensors.point_cloud.file_bytes import CloudFileError
from mosaic_sensors.point_cloud.original_form import OriginalForm
from mosaic_sensors.point_cloud.udp import UdpPointCloud

LINE = np.stack([np.arange(100) / 10, np.zeros(100), np.ones(100)], axis=1)


class Depth(PointCloudSender):
    """Yields the line ten times a second."""

    is_closed = False

    def clouds(self) -> Iterator[Any]:
        try:
            for _ in self.every(0.1):
                yield LINE
        finally:
            self.is_closed = True


class DepthConfigurer(DataChannelConfigurer[PointCloudParams]):
    connector_type = "depth"

    def configure(self) -> Any:
        return Depth(self.label, self.params).handlers()


def depth(**params: Any) -> tuple[Depth, Any]:
    sender, *channels = build(DepthConfigurer, label="cloud", params=params)
    return sender, channels


def points_in(sender: Any, index: int = -1) -> Any:
    return decoded(fake_host(sender).sent[index].payload).xyz


def test_a_plugin_yields_arrays_and_operators_get_clouds() -> None:
    sender, _ = depth()
    [data] = collect(sender, 1)
    assert np.abs(decoded(data).xyz - LINE).max() <= 0.005 + 1e-9
    assert sender.is_closed
    assert sender.data_type is MosaicDataType.BYTE_R2U
    assert isinstance(sender.delivery, DeliveryContract)
    assert (sender.delivery.mode, sender.delivery.newest_wins) == (Delivery.BULK, True)


def test_params_thin_crop_and_round() -> None:
    sender, _ = depth(voxel_size_m=1, crop_max_m=[5, 5, 5], min_range_m=2.5, resolution_m=0.5)
    xyz = decoded(collect(sender, 1)[0]).xyz
    assert len(xyz) == 4
    assert (xyz * 2 == np.rint(xyz * 2)).all()
    assert len(decoded(collect(depth(max_points=7)[0], 1)[0])) == 7


def test_a_cloud_that_comes_before_its_turn_is_not_even_made(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[float] = []
    sender, _ = depth(max_rate_hz=2)

    def clouds() -> Iterator[Any]:
        for _ in sender.every(0.1):
            yield lambda: made.append(sender.monotonic_s()) or LINE

    monkeypatch.setattr(sender, "clouds", clouds)
    assert len(collect(sender, 5)) == len(made) == 5
    assert fake_host(sender).losses["thinned"] >= 12


def test_clouds_beyond_the_rate_are_left_out_and_a_jittering_source_is_not_halved() -> None:
    sender, _ = depth(max_rate_hz=2)
    collect(sender, 5)
    stamps = np.diff([message.stamp_us for message in fake_host(sender).sent]) / 1e6
    assert stamps.mean() == pytest.approx(0.5, rel=0.15)
    assert fake_host(sender).losses["thinned"] >= 12
    sender, _ = depth(max_rate_hz=10)
    host = fake_host(sender)
    sent = 0
    for pause_s in (0.099, 0.102, 0.098, 0.101) * 25:
        sent += sender.send_points(LINE)
        host.clock.advance(pause_s)
    assert sent >= 98


def test_pushed_points_carry_intensity_colour_frame_and_time() -> None:
    sender, _ = depth()
    captured_at_s = fake_host(sender).clock.now_s - 0.04
    assert sender.send_points(LINE, np.arange(100), np.full((100, 3), 9, np.uint8), "lidar", captured_at_s)
    cloud = decoded(fake_host(sender).sent[-1].payload)
    assert cloud.frame_id == "lidar"
    assert cloud.captured_at_s == pytest.approx(captured_at_s)
    assert cloud.intensity is not None
    assert cloud.rgb is not None
    assert cloud.intensity.max() == 99
    with pytest.raises(ValueError, match="intensity has 3 rows"):
        depth()[0].send_points(LINE, [1, 2, 3])


def test_nothing_is_computed_for_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    sender, channels = depth(parallel_num=2)
    for handler in (sender, *channels):
        fake_host(handler).heard = set()
    monkeypatch.setattr("mosaic_sensors.point_cloud.sender.filtered", lambda *_: pytest.fail("computed"))
    assert not sender.is_heard
    assert not sender.send_points(LINE)
    assert fake_host(sender).losses == {}


def test_an_original_dashboard_alone_costs_no_compact_form_and_gets_meta_and_chunks_on_one_channel() -> None:
    sender, (first, second) = depth(parallel_num=2, stream_mode="simple")
    assert [channel.label for channel in (first, second)] == ["cloud-0", "cloud-1"]
    assert all(channel.is_for_originals for channel in (first, second))
    fake_host(sender).heard = set()
    fake_host(first).heard = set()
    assert sender.send_points(LINE)
    assert (fake_host(sender).sent, fake_host(first).sent) == ([], [])
    [burst] = fake_host(second).sent
    wanted = OriginalForm("simple").messages(cloud_of(LINE), 0)
    assert len(burst.followers) == len(wanted) - 1
    assert burst.size_bytes == pytest.approx(sum(map(len, wanted)), abs=40)


def test_a_cloud_too_large_for_one_message_is_thinned_until_it_fits() -> None:
    sender, _ = depth(max_points=2_000_000, compress="never", resolution_m=1e-5)
    wide = np.random.default_rng(0).uniform(-100, 100, (1_500_000, 3)).astype(np.float32)
    assert sender.send_points(wide)
    data = fake_host(sender).sent[-1].payload
    assert MAX_MESSAGE_BYTES * 0.8 < len(data) <= MAX_MESSAGE_BYTES
    assert len(decoded(data)) > 1_000_000


@pytest.mark.parametrize(("compress", "is_deflated"), [("auto", True), ("always", True), ("never", False)])
def test_deflate_is_the_users_choice(compress: str, is_deflated: bool) -> None:
    sender, _ = depth(compress=compress)
    assert bool(collect(sender, 1)[0][4] & 1) is is_deflated


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"max_range_m": 1, "min_range_m": 2}, "max_range_m"),
        ({"crop_min_m": [0, 0, 0], "crop_max_m": [1, 0, 1]}, "crop_min_m"),
        ({"parallel_num": 0}, "parallel_num"),
        ({"stream_mode": "fast"}, "stream_mode"),
    ],
)
def test_params_that_leave_nothing_are_refused(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        depth(**params)


# -- the connector -----------------------------------------------------------------------------------------------


def connector(**params: Any) -> Any:
    return build(PointCloudConfigurer, label="cloud", params=params)[0]


def test_files_play_at_their_rate_and_again(tmp_path: Path) -> None:
    for number in (1, 2):
        np.save(tmp_path / f"{number}.npy", np.full((1, 3), float(number)))
    player = connector(source=str(tmp_path), rate_hz=4, frame_id="map")
    clouds = [decoded(data) for data in collect(player, 5)]
    assert [cloud.xyz[0, 0] for cloud in clouds] == [1, 2, 1, 2, 1]
    assert clouds[0].frame_id == "map"
    stamps = [message.stamp_us for message in fake_host(player).sent]
    assert np.diff(stamps) == pytest.approx([250_000] * 4)
    once = connector(source=str(tmp_path), loop=False)
    assert len(collect(once, None)) == 2


def test_a_folder_that_is_away_for_thirty_seconds_is_gone_and_played_again_when_it_returns(tmp_path: Path) -> None:
    disk = tmp_path / "usb"
    player = connector(source=str(disk), rate_hz=4)
    for is_there in (True, *[False] * 6, True):
        fake_host(player).clock.advance(5.0)
        if is_there:
            disk.mkdir()
            np.save(disk / "1.npy", np.ones((1, 3)))
            assert len(collect(player, 3)) == 3
            (disk / "1.npy").unlink()
            disk.rmdir()
        else:
            with pytest.raises(DeviceGone, match="usb"):
                collect(player, 1)


def test_a_file_that_cannot_be_read_ends_the_run_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"nonsense")
    with pytest.raises(CloudFileError, match=r"a\.ply: it doesn't begin"):
        collect(connector(source=str(tmp_path / "a.ply")), 1)


@pytest.mark.parametrize("source", ["http://x/y.ply", "udp://0.0.0.0", "udp://robot:9000", "udp://[::1", ""])
def test_sources_that_are_none_are_refused_at_once(source: str) -> None:
    with pytest.raises(ConfigError, match="source"):
        connector(source=source)


class SendingHost(FakeHost):
    """Sends the datagrams when the handler first looks whether it shall stop; lets it stop after the last."""

    def __init__(self, datagrams: list[bytes]) -> None:
        super().__init__()
        self.handler: UdpPointCloud | None = None
        self._datagrams = datagrams
        self._looks = 0

    @property
    def is_stopping(self) -> bool:
        if self._looks == 0:
            assert self.handler is not None
            address = self.handler.datagrams.address
            assert address is not None
            family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
            with socket.socket(family, socket.SOCK_DGRAM) as program:
                for datagram in self._datagrams:
                    program.sendto(datagram, address)
        self._looks += 1
        return self._looks > len(self._datagrams)


@pytest.mark.parametrize("address", ["127.0.0.1", "[::1]"])
def test_another_programs_datagrams_become_clouds(address: str, caplog: pytest.LogCaptureFixture) -> None:
    handler = connector(source=f"udp://{address}:0", frame_id="lidar")
    whole, broken, newest = (list(datagrams_of(np.tile(LINE, (5, 1)), number)) for number in (1, 2, 3))
    host = SendingHost([b"nonsense", b"more", *whole, *broken[:-1], *newest])
    host.handler = handler
    handler.bind(host)
    clouds = list(handler.clouds())
    assert [(len(cloud), cloud.frame_id) for cloud in clouds] == [(500, "lidar"), (500, "lidar")]
    assert host.losses == {"refused": 2, "lost": 1}
    assert sum("refused a datagram" in record.getMessage() for record in caplog.records) == 1


def test_a_taken_port_is_told() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(DeviceGone, match=f"can't listen on UDP 127.0.0.1 port {port}"):
            next(iter(connector(source=f"udp://127.0.0.1:{port}").clouds()))


def test_the_wall_time_of_original_dashboards_is_that_of_the_capture() -> None:
    sender, [channel] = depth()
    sender.send_points(LINE, captured_at_s=fake_host(sender).clock.now_s - 5.0)
    meta = fake_host(channel).sent[-1].payload
    stamp_us = float(np.frombuffer(meta[1:9], "<f8")[0])
    assert time.time() * 1e6 - stamp_us == pytest.approx(5e6, abs=2e6)


# -- documentation and example -----------------------------------------------------------------------------------

ROOT = Path(__file__).parents[4]


def code_blocks() -> list[str]:
    page = (ROOT / "docs" / "howto" / "point-clouds.md").read_text()
    return re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("text", code_blocks())
def test_the_code_of_the_guide_runs(text: str) -> None:
    namespace = types.ModuleType("guide").__dict__
    exec(compile(text, "point-clouds.md", "exec"), namespace)  # noqa: S102 - our own documentation
    if "BallConfigurer" in namespace:
        ball = build(namespace["BallConfigurer"], label="ball")[0]
        assert len(decoded(collect(ball, 2)[1])) == 20_000


def test_the_example_sends_whole_clouds() -> None:
    text = (ROOT / "examples" / "points-by-udp" / "send_points.py").read_text()
    namespace = types.ModuleType("example").__dict__
    exec(compile(text, "send_points.py", "exec"), namespace)  # noqa: S102 - our own example
    assembly = Assembly()
    whole = [assembly.feed(part, "a", 0.0) for part in datagrams_of(namespace["wave"](0.3), 1)][-1]
    assert whole is not None
    assert whole.points.shape == (14_400, 4)
