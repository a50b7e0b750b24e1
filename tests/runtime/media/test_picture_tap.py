"""A tap of pictures before encoding: the camera runs for it, and who asks gets a copy of the next one."""

from __future__ import annotations

import asyncio
from typing import Any

import av
import numpy as np

from mosaic_core.contract.media import Captured, EncodingParams
from mosaic_core.contract.media_tap import TappedImage
from mosaic_core.laboratory.joining import until
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.media_tap import RuntimePictureTap
from mosaic_core.runtime.media.plain_stream import plain_streams
from mosaic_core.runtime.observation.counters import ConnectorCounters


class Bench:
    """A hub with the camera ``front``."""

    def __init__(self) -> None:
        self.watched: list[tuple[str, bool]] = []
        self.loop = asyncio.get_running_loop()
        self.hub = MediaHub(
            plain_streams(lambda captured: captured.image), lambda label, on: self.watched.append((label, on))
        )
        self.hub.add_label("front", EncodingParams(), ConnectorCounters())

    def tap(self, label: str = "front") -> RuntimePictureTap:
        return RuntimePictureTap(self.loop, self.hub, label)

    async def asked(self, tap: RuntimePictureTap) -> asyncio.Task[TappedImage | None]:
        """A reader that waits for the next picture."""
        reading = asyncio.create_task(asyncio.to_thread(tap.next, 20.0))
        await until(lambda: tap._is_asked)
        return reading


def image(value: int) -> Any:
    return np.full((4, 6, 3), value, np.uint8)


async def test_the_camera_runs_for_the_tap_alone_and_rests_when_it_is_closed() -> None:
    bench = Bench()
    assert not bench.hub.offer("front", image(1))
    with bench.tap():
        await until(lambda: bench.watched == [("front", True)])
        assert bench.hub.offer("front", image(1))
    await until(lambda: bench.watched == [("front", True), ("front", False)])
    assert not bench.hub.offer("front", image(1))


async def test_it_gets_the_next_picture_after_it_asked_and_nothing_older() -> None:
    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        bench.hub.offer("front", image(1))
        reading = await bench.asked(tap)
        bench.hub.offer("front", Captured(image(2), 77.5))
        bench.hub.offer("front", image(3))
        got = await reading
        assert got is not None
        assert (got.image[0, 0, 0], got.captured_at_s) == (2, 77.5)
        assert tap.next(0.0) is None


async def test_what_it_gets_is_its_own_when_the_camera_fills_its_buffer_again() -> None:
    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        reading = await bench.asked(tap)
        buffer = image(5)
        bench.hub.offer("front", buffer)
        buffer[:] = 6
        got = await reading
        assert got is not None
        assert np.array_equal(got.image, image(5))


async def test_two_taps_of_one_camera_do_not_disturb_each_other() -> None:
    bench = Bench()
    with bench.tap() as one:
        with bench.tap() as other:
            await until(lambda: bench.hub.viewers("front") == 2)
            readings = [await bench.asked(one), await bench.asked(other)]
            bench.hub.offer("front", image(5))
            assert None not in await asyncio.gather(*readings)
        await until(lambda: bench.hub.viewers("front") == 1)
        reading = await bench.asked(one)
        bench.hub.offer("front", image(6))
        assert await reading is not None


async def test_a_frame_of_libav_comes_as_an_array() -> None:
    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        reading = await bench.asked(tap)
        bench.hub.offer("front", av.VideoFrame.from_ndarray(image(9), format="bgr24"))
        got = await reading
        assert got is not None
        assert np.array_equal(got.image, image(9))


async def test_a_camera_that_encodes_by_itself_is_said_so_until_it_yields_something_else() -> None:
    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        reading = await bench.asked(tap)
        bench.hub.offer("front", av.Packet(b"encoded"))
        assert await reading is None
        assert tap.failure == "media.encoded_only"
        reading = await bench.asked(tap)
        bench.hub.offer("front", image(1))
        assert await reading is not None
        assert tap.failure == ""


async def test_a_label_that_is_no_camera_is_said_so() -> None:
    bench = Bench()
    with bench.tap("frnt") as tap:
        assert await asyncio.to_thread(tap.next, 20.0) is None
        assert tap.failure == "channel.unknown_label"


def test_a_stopped_robot_is_said_so() -> None:
    async def made() -> RuntimePictureTap:
        return Bench().tap()

    with asyncio.run(made()) as tap:
        assert tap.next(20.0) is None
        assert tap.failure == "peer.shutdown"


async def test_nobody_asks_nothing_is_copied() -> None:
    class Uncopyable:
        """Stands for a large picture."""

        shape = (2, 2, 3)

        def copy(self) -> None:
            raise AssertionError("copied")

    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        assert bench.hub.offer("front", Uncopyable())  # type: ignore[arg-type]
        assert tap.failure == ""
