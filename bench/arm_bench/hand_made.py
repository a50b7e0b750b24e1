"""The peer: what one writes by hand in an afternoon, JSON over a WebSocket, 100 times a second, on the same arms.

    python hand_made.py robot PORT LISTEN          python hand_made.py operator PORT URL

No lease, no limits, no time-out.
"""

from __future__ import annotations

import asyncio
import json
import sys

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve

from mosaic_arm.params import ArmParams, JointParams
from mosaic_arm.shared_arm import KeptArm

JOINT = "joint"
RATE_HZ = 100
FASTEST_RADPS = 20.0
"""No limit here, nor of ours: what is measured is the way, not the joint."""


def arm(port: str, *, is_free: bool) -> KeptArm:
    joints = {JOINT: JointParams(id=1, max_radps=FASTEST_RADPS)}
    return KeptArm(ArmParams(port=port, joints=joints, gripper=None, starts_free=is_free))


async def follow(port: str, listen: str) -> None:
    with arm(port, is_free=False) as follower:

        async def take(socket: ServerConnection) -> None:
            async for message in socket:
                follower.aim(json.loads(message), socket)

        host, _, number = listen.rpartition(":")
        async with serve(take, host, int(number)) as server:
            print("ready", flush=True)
            await server.serve_forever()


async def lead(port: str, url: str) -> None:
    with arm(port, is_free=True) as leader:
        await asyncio.to_thread(leader.wait_open, 5.0)
        async with connect(url) as socket:
            print("ready", flush=True)
            next_s = asyncio.get_running_loop().time()
            while leader.snapshot is not None:
                await socket.send(json.dumps(leader.snapshot.angles_rad))
                next_s += 1 / RATE_HZ
                await asyncio.sleep(next_s - asyncio.get_running_loop().time())


if __name__ == "__main__":
    _, side, its_port, place = sys.argv
    asyncio.run((follow if side == "robot" else lead)(its_port, place))
