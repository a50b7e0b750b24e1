"""A program beside the robot that sends points by UDP: a wave that runs over a square, ten times a second.

Run `mosaic run mosaic_config.yaml` in this folder, then `python send_points.py`.
"""

from __future__ import annotations

import socket
import time

import numpy as np

from mosaic_sensors.point_cloud.datagrams import datagrams_of

ADDRESS = ("127.0.0.1", 9010)
PERIOD_S = 0.1


def wave(time_s: float) -> np.ndarray:
    """(n, 4): x, y, z in metres, and an intensity."""
    x, y = np.meshgrid(np.linspace(-4, 4, 120), np.linspace(-4, 4, 120))
    z = 0.4 * np.sin(2 * np.hypot(x, y) - 3 * time_s)
    return np.stack([x, y, z, z - z.min()], axis=-1).reshape(-1, 4)


def main() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        number = 0
        while True:
            for datagram in datagrams_of(wave(number * PERIOD_S), number):
                sender.sendto(datagram, ADDRESS)
            number += 1
            time.sleep(PERIOD_S)


if __name__ == "__main__":
    main()
