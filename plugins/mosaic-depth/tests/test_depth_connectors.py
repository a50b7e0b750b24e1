"""Depth cameras as connectors: one device for all that show it, which may vanish, stay silent or give garbage."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest

from mosaic_core import DeviceGone, Shared
from mosaic_core.testing import FakeClock, build, collect, connector, fake_host, joined, take_frames
from mosaic_core.words.errors import ConfigError, MosaicError
from mosaic_depth import DepthCameraParams, DepthFrame, Intrinsics
from mosaic_depth.camera_registry import opener_of
from mosaic_depth.cloud import DepthCloud, DepthCloudConfigurer
from mosaic_depth.fake_camera import FakeDepthCamera
from mosaic_depth.pictures import DepthCameraConfigurer, DepthPictureConfigurer
from mosaic_depth.shared_camera import SILENCE_S, SharedDepthCamera
from mosaic_sensors.point_cloud import decoded

SMALL = {"source": "fake", "width": 64, "height": 48}
GARBAGE = DepthFrame(np.zeros((2, 2), np.uint8), np.ones((2, 2)), Intrinsics(1, 1, 0, 0))


class Plug:
    """A depth camera on a plug that a test pulls. It takes a picture per thirtieth of a second of the fake clock."""

    def __init__(self) -> None:
        self.clock = FakeClock()
        self.is_plugged_in = True
        self.gives: Callable[[DepthFrame], DepthFrame | None] = lambda frame: frame
        self.opened = self.closed = self.given = 0

    def __call__(self, params: DepthCameraParams) -> Plug:
        self._answer()
        self.opened += 1
        self._camera = FakeDepthCamera(params, self.clock.advance)
        return self

    def next(self, timeout_s: float) -> DepthFrame | None:
        self._answer()
        frame = self._camera.next(timeout_s)
        assert frame is not None
        self.given += 1
        return self.gives(frame)

    def close(self) -> None:
        self.closed += 1
        self._answer()

    def _answer(self) -> None:
        if not self.is_plugged_in:
            raise OSError(19, "No such device")

    def shared(self) -> Shared:
        shared = Shared()
        params = DepthCameraParams.model_validate(SMALL)
        shared.get("mosaic-depth:fake", lambda: SharedDepthCamera(params, self))
        return shared


@pytest.fixture
def plug() -> Iterator[Plug]:
    made = Plug()
    yield made
    assert made.opened == made.closed


def of(configurer: Any, plug: Plug, **params: Any) -> Any:
    made = build(configurer, params={"camera": SMALL, **params}, shared=plug.shared(), clock=plug.clock)
    return made[0] if isinstance(made, tuple) else made


def test_picture_depth_and_cloud_of_one_moment_lie_over_each_other(plug: Plug) -> None:
    shared = plug.shared()
    colour = build(DepthCameraConfigurer, params={"camera": SMALL}, shared=shared, clock=plug.clock)
    depth = build(DepthPictureConfigurer, params={"camera": SMALL}, shared=shared, clock=plug.clock)
    cloud: Any = build(DepthCloudConfigurer, params={"camera": SMALL, "step_px": 1}, shared=shared, clock=plug.clock)[0]
    with (
        closing(iter(colour.frames())) as pictures,
        closing(iter(depth.frames())) as depths,
        closing(iter(cloud.clouds())) as clouds,
    ):
        seen, far, made = next(pictures), next(depths), next(clouds)()
    assert plug.given == plug.opened == 1
    assert seen.captured_at_s == far.captured_at_s == made.captured_at_s == pytest.approx(1000 + 1 / 30)
    rows, columns = np.nonzero(far.image.any(axis=2))
    assert (made.rgb[:, ::-1] == seen.image[rows, columns]).all()
    is_ball = made.rgb[:, 0] == 220
    assert 1.0 <= made.xyz[is_ball, 0].min() < 1.05
    assert made.xyz[~is_ball, 0].max() == 3.0


def test_the_cloud_comes_in_the_compact_form_at_its_rate_and_counts_what_it_thins(plug: Plug) -> None:
    cloud: DepthCloud = of(DepthCloudConfigurer, plug, max_rate_hz=5, max_range_m=2, frame_id="front")
    clouds = [decoded(message) for message in collect(cloud, 11)]
    assert (clouds[0].frame_id, clouds[0].xyz.max() <= 2.01) == ("front", True)
    assert plug.clock.now_s - 1000 == pytest.approx(2.0, abs=0.2)
    assert fake_host(cloud).losses["thinned"] == plug.given - 11


def test_an_original_dashboard_alone_opens_the_camera_and_gets_its_cloud(plug: Plug) -> None:
    params = {"camera": SMALL}
    cloud, channel, intrinsics = build(DepthCloudConfigurer, params=params, shared=plug.shared(), clock=plug.clock)
    assert [one.label for one in (cloud, channel, intrinsics)] == [
        "under_test",
        "under_test-0",
        "under_test_intrinsics",
    ]
    fake_host(cloud).heard = set()

    def unplugged_after_20(frame: DepthFrame) -> DepthFrame:
        plug.is_plugged_in = plug.given < 20
        return frame

    plug.gives = unplugged_after_20
    with pytest.raises(DeviceGone):
        collect(cloud, 1)
    assert fake_host(cloud).sent == []
    bursts = fake_host(channel).sent
    assert len(bursts) >= 5
    assert all(one.followers for one in bursts)


def test_the_intrinsics_are_told_once_and_again_when_they_change(plug: Plug) -> None:
    cloud: DepthCloud = of(DepthCloudConfigurer, plug, frame_id="front")
    cloud.intrinsics.bind(fake_host(cloud))
    collect(cloud, 3)
    texts = [one.payload.decode() for one in fake_host(cloud).sent if one.channel == "under_test_intrinsics"]
    assert len(texts) == 1
    assert '"width_px":64' in texts[0].replace(" ", "")
    plug.gives = lambda frame: replace(frame, intrinsics=Intrinsics(10, 10, 5, 5))
    collect(cloud, 1)
    texts = [one.payload.decode() for one in fake_host(cloud).sent if one.channel == "under_test_intrinsics"]
    assert len(texts) == 2
    assert '"fx_px":10' in texts[1].replace(" ", "")


@pytest.mark.parametrize("configurer", [DepthCameraConfigurer, DepthPictureConfigurer, DepthCloudConfigurer])
def test_a_camera_that_is_away_for_thirty_seconds_is_gone_and_shown_again_when_it_returns(
    configurer: Any, plug: Plug
) -> None:
    handler = of(configurer, plug)
    taken = collect if isinstance(handler, DepthCloud) else take_frames
    body = handler.messages if isinstance(handler, DepthCloud) else handler.frames
    with closing(iter(body())) as items:
        next(items)
        plug.is_plugged_in = False
        with pytest.raises(DeviceGone, match=r"depth camera fake: No such device; check cable"):
            next(items)
    for _ in range(6):
        plug.clock.advance(5.0)
        with pytest.raises(DeviceGone, match="No such device"):
            taken(handler, 1)
    plug.is_plugged_in = True
    assert len(taken(handler, 2)) == 2
    assert (plug.opened, plug.closed) == (2, 2)


def test_a_camera_that_falls_silent_is_gone_after_some_seconds(plug: Plug) -> None:
    handler = of(DepthCameraConfigurer, plug)
    plug.gives = lambda frame: None
    with pytest.raises(DeviceGone, match=f"gives no picture for {SILENCE_S:g} s"):
        take_frames(handler, 1)
    assert plug.clock.now_s == pytest.approx(1000 + SILENCE_S, abs=0.1)
    assert fake_host(handler).losses["refused"] == 0


def test_garbage_among_pictures_is_left_out_and_counted(plug: Plug) -> None:
    handler = of(DepthPictureConfigurer, plug)
    plug.gives = lambda frame: frame if plug.given % 3 == 0 else GARBAGE
    assert len(take_frames(handler, 4)) == 4
    assert fake_host(handler).losses["refused"] == 8
    assert plug.opened == 1


def test_a_camera_that_gives_nothing_but_garbage_is_opened_anew(plug: Plug) -> None:
    handler = of(DepthCloudConfigurer, plug)
    plug.gives = lambda frame: GARBAGE
    with pytest.raises(DeviceGone, match=r"gives a colour picture of uint8 \(2, 2\), not .* for 6 s"):
        collect(handler, 1)
    plug.gives = lambda frame: frame
    assert len(collect(handler, 1)) == 1
    assert plug.opened == 2


def test_what_a_driver_did_not_expect_is_told_as_its_bug_and_leaves_the_device(plug: Plug) -> None:
    def broken(frame: DepthFrame) -> DepthFrame:
        raise KeyError("serial")

    plug.gives = broken
    with pytest.raises(KeyError):
        take_frames(of(DepthCameraConfigurer, plug), 1)


def test_a_reader_that_is_slow_gets_the_newest_and_no_queue(plug: Plug) -> None:
    shared = plug.shared()
    fast = build(DepthCameraConfigurer, label="fast", params={"camera": SMALL}, shared=shared, clock=plug.clock)
    slow = build(DepthPictureConfigurer, label="slow", params={"camera": SMALL}, shared=shared, clock=plug.clock)
    with closing(iter(fast.frames())) as pictures, closing(iter(slow.frames())) as depths:
        next(depths)
        for _ in range(500):
            last = next(pictures)
        assert next(depths).captured_at_s == last.captured_at_s
        assert plug.given == 500
        assert next(depths).captured_at_s > last.captured_at_s


def test_three_readers_at_once_share_one_device_and_miss_nothing_that_is_wrong() -> None:
    params = DepthCameraParams.model_validate({**SMALL, "fps": 120})
    camera = SharedDepthCamera(params)
    handlers = [build(DepthCameraConfigurer, label=f"n{n}", params={"camera": SMALL}) for n in range(3)]
    stamps: list[list[float]] = [[], [], []]

    def read(n: int) -> None:
        fake_host(handlers[n]).arm()
        with closing(camera.frames(handlers[n])) as frames:
            for frame, _ in zip(frames, range(20), strict=False):
                stamps[n].append(frame.captured_at_s or 0.0)

    threads = [threading.Thread(target=read, args=(n,)) for n in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert [len(one) for one in stamps] == [20, 20, 20]
    assert camera._camera is None


async def test_an_operator_sees_all_three() -> None:
    shared = [
        connector(DepthCameraConfigurer, label="front", params={"camera": SMALL}),
        connector(DepthPictureConfigurer, label="front_depth", params={"camera": SMALL}),
        connector(DepthCloudConfigurer, label="front_cloud", params={"camera": SMALL}),
    ]
    async with joined(*shared) as link:
        picture = await link.connection.media("front").next_image()
        depth = await link.connection.media("front_depth").next_image()
        cloud = decoded((await link.connection.receivable("front_cloud").next_message()).data)
        intrinsics = await link.connection.receivable("front_cloud_intrinsics").next_message()
    assert picture.shape == depth.shape == (48, 64, 3)
    assert 300 < len(cloud) <= 32 * 24
    assert b'"width_px"' in bytes(intrinsics.data)


def test_connectors_that_describe_one_camera_differently_are_told() -> None:
    shared = Shared()
    build(DepthCameraConfigurer, params={"camera": SMALL}, shared=shared)
    with pytest.raises(MosaicError, match=r"describe the depth camera fake differently: fps"):
        build(DepthPictureConfigurer, params={"camera": {**SMALL, "fps": 5}}, shared=shared)


@pytest.mark.parametrize(
    ("params", "told"),
    [
        ({"camera": {"source": "realsens"}}, "no depth camera 'realsens'; did you mean 'realsense'"),
        ({"camera": {"source": "fake", "fps": 0}}, "fps"),
        ({"near_m": 4, "far_m": 3}, "far_m .* is not beyond near_m"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any], told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        build(DepthPictureConfigurer, params=params)


def test_a_kind_of_camera_that_is_claimed_twice_or_broken_is_named() -> None:
    def point(value: str) -> EntryPoint:
        return EntryPoint("acme", value, "mosaic.depth_cameras")

    with pytest.raises(ValueError, match="claimed by acme:A and acme:B"):
        opener_of("acme", [point("acme:A"), point("acme:B")])
    with pytest.raises(ValueError, match="can't be loaded from no_such_module:A: ModuleNotFoundError"):
        opener_of("acme", [point("no_such_module:A")])
    with pytest.raises(ValueError, match="mosaic_depth:__doc__ can't be called"):
        opener_of("acme", [point("mosaic_depth:__doc__")])
    assert opener_of("acme", [point("mosaic_depth.fake_camera:FakeDepthCamera")] * 2) is FakeDepthCamera
