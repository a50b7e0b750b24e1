"""A WebSocket that speaks the original envelope `{"type", "data"}`, and a REST session as the original page has one."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

WAIT_S = 20.0


async def until(condition: Callable[[], Any], what: str, timeout_s: float = WAIT_S) -> float:
    """Wait until `condition` holds; returns the seconds it took, fails with `what` otherwise."""
    start_s = time.monotonic()
    while not condition():
        assert time.monotonic() - start_s < timeout_s, f"after {timeout_s} s still not true: {what}"
        await asyncio.sleep(0.01)
    return time.monotonic() - start_s


class Wire:
    """One socket; whoever subclasses it answers in :meth:`heard`."""

    def __init__(self, url: str, path: str) -> None:
        self.address = url.replace("http", "ws", 1) + path
        self.frames: list[dict[str, Any]] = []
        """Everything the server said."""
        self.pings = 0
        self._socket: ClientConnection | None = None
        self._reading: asyncio.Task[None] | None = None

    async def open(self) -> None:
        self._socket = await connect(self.address)
        self._reading = asyncio.create_task(self._read(self._socket))

    async def shut(self) -> None:
        if self._socket is not None:
            await self._socket.close()
        if self._reading is not None:
            await self._reading

    async def say(self, kind: str, data: Any) -> None:
        assert self._socket is not None
        with suppress(ConnectionClosed):  # it is said into a socket that is going: lost
            await self._socket.send(json.dumps({"type": kind, "data": data}))

    def said(self, kind: str) -> list[Any]:
        return [frame["data"] for frame in self.frames if frame["type"] == kind]

    async def _read(self, socket: ClientConnection) -> None:
        async for text in socket:
            assert isinstance(text, str), "a binary frame on the signaling socket"
            frame = json.loads(text)
            self.frames.append(frame)
            await self.heard(frame["type"], frame["data"])

    async def heard(self, kind: str, data: Any) -> None:
        raise NotImplementedError


class Rest:
    """The REST calls of the original page; every answer must be its envelope with the number 100."""

    def __init__(self, url: str) -> None:
        self.http = httpx.AsyncClient(base_url=url, timeout=WAIT_S)
        self.token = ""

    async def log_in(self, email: str, password: str) -> None:
        done = await self("POST", "/api/v1/account/login/access-token", username=email, password=password)
        self.token = done["accessToken"]
        self.http.headers["Authorization"] = f"Bearer {self.token}"

    async def __call__(self, method: str, path: str, **body: Any) -> Any:
        answer = await self.http.request(method, path, json=body or None)
        assert answer.status_code == 200, f"{method} {path}: {answer.status_code} {answer.text}"
        envelope = answer.json()
        assert set(envelope) == {"resultCode", "resultData"}, f"{method} {path}: {envelope}"
        assert envelope["resultCode"] == 100
        return envelope["resultData"]

    async def robots(self) -> list[dict[str, Any]]:
        listed = await self("GET", "/api/v1/robots?skip=0&limit=100")
        assert set(listed) == {"data", "count"}
        return list(listed["data"])

    async def robot(self, robot_id: str) -> dict[str, Any]:
        return dict(await self("GET", f"/api/v1/robots/{robot_id}"))

    async def add_robot(self, name: str, *, with_token: bool = True) -> tuple[str, str]:
        """Id and token (empty without) of a new robot."""
        await self("POST", "/api/v1/robots", name=name, description="", authType=int(with_token))
        robot_id = next(robot["id"] for robot in await self.robots() if robot["name"] == name)
        if not with_token:
            return robot_id, ""
        return robot_id, (await self("POST", "/api/v1/robots/auth/simple-token", robotId=robot_id))["token"]

    async def close(self) -> None:
        await self.http.aclose()
