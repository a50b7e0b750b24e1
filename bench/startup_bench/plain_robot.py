"""The peer of the comparison: a process that holds one data channel of plain aiortc open until its stdin closes."""

from __future__ import annotations

import asyncio
import json
import sys


async def answered() -> None:
    from aiortc import RTCPeerConnection, RTCSessionDescription

    peer = RTCPeerConnection()
    offer = json.loads(await asyncio.to_thread(sys.stdin.readline))
    await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
    await peer.setLocalDescription(await peer.createAnswer())
    print(json.dumps(peer.localDescription.sdp), flush=True)
    await asyncio.to_thread(sys.stdin.readline)
    await peer.close()


if __name__ == "__main__":
    asyncio.run(answered())
