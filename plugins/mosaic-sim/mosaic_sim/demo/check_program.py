"""The operator of the headless check: ``python -m … URL EMAIL ROBOT_ID [--any-robot] [LABEL …]``.

The labels are those of connectors that ``--with`` has brought; with ``--any-robot`` nothing else is looked at. The
password comes in the environment. Prints one JSON array of results.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from collections.abc import Sequence
from functools import partial

from mosaic_core import MosaicError
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.words.errors import whole_sentence
from mosaic_sim.demo.checks import (
    Result,
    driving_moves,
    lease_is_granted,
    messages_arrive,
    pictures_arrive,
    silence_stops,
    told,
)
from mosaic_sim.demo.headless_check import ANY_ROBOT, CONNECT, PASSWORD_VARIABLE
from mosaic_sim.demo.own_checks import own_works

SENSORS = ("scan", "imu", "battery", "gps", "host")


async def results_for(
    url: str, email: str, password: str, robot_id: str, own: Sequence[str] = (), *, is_yard: bool = True
) -> list[Result]:
    """Sign in, connect, and look at everything once."""
    began_s = time.monotonic()
    try:
        async with await MosaicOperator.login(url, email, password) as operator:
            connection = await operator.connect(robot_id)
            connected = Result(CONNECT, True, f"{(time.monotonic() - began_s) * 1000:.0f} ms from signing in")
            looked_at = await _looked_at(connection) if is_yard else []
            brought = [await told(label, partial(own_works, connection, label, url, own)) for label in own]
            return [connected, *looked_at, *brought]
    except MosaicError as error:
        return [Result(CONNECT, False, f"{whole_sentence(error.message)} {error.cure}".strip())]


async def _looked_at(connection: RobotConnection) -> list[Result]:
    camera, pose = connection.media("front"), connection.receivable("pose")
    wheels = connection.sendable("cmd_vel")
    results = [await told("pictures", partial(pictures_arrive, camera))]
    for label in SENSORS:
        results.append(await told(label, partial(messages_arrive, connection.receivable(label))))
    await wheels.wait_open()
    results.append(await told("lease", partial(lease_is_granted, connection.control)))
    results.append(await told("drive", partial(driving_moves, wheels, pose)))
    results.append(await told("silence stops", partial(silence_stops, pose)))
    return results


def main() -> None:
    url, email, robot_id, *own = sys.argv[1:]
    is_yard, labels = ANY_ROBOT not in own, [label for label in own if label != ANY_ROBOT]
    results = asyncio.run(results_for(url, email, os.environ[PASSWORD_VARIABLE], robot_id, labels, is_yard=is_yard))
    print(json.dumps([result.wire() for result in results]))


if __name__ == "__main__":
    main()
