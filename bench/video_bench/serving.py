"""What every way of serving a camera shares: the camera that films a scene, and the orders of the benchmark."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection

from video_bench.scene import Image

FPS = 30
BITRATE_BPS = 1_000_000


class Camera:
    """Posts the pictures at their time, from a thread as a handler does."""

    def __init__(self, pictures: Sequence[Image], post: Callable[[Image, float], object]) -> None:
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._film, args=(pictures, post))
        self.cpu_s = 0.0
        self._thread.start()

    def _film(self, pictures: Sequence[Image], post: Callable[[Image, float], object]) -> None:
        began_s, number = time.monotonic(), 0
        while not self._is_over.wait(max(0.0, began_s + number / FPS - time.monotonic())):
            post(pictures[number % len(pictures)], time.monotonic())
            self.cpu_s = time.thread_time()
            number += 1

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()


async def serve(orders: Connection, encoder_cpu_s: Callable[[], float]) -> None:
    orders.send("ready")
    while await asyncio.to_thread(orders.recv) == "spent":
        orders.send((encoder_cpu_s(), time.process_time()))
