"""What a test holds of the server and the robot in the lab. The drive of the robot writes down every command with the
time; the clock is the same in all processes of a machine."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from httpx import AsyncClient
from laboratory.forwarding import Lab
from laboratory.processes import Process

from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.testing import until

TWIST = {"linear": {"x": 0.4}, "angular": {"z": 0.2}}
STANDING = {"linear": {"x": 0.0}, "angular": {"z": 0.0}}
_numbers = count()


@dataclass
class Track:
    """What the robot's drives were told: ``(monotonic s, whether to move)``, oldest first."""

    file: Path

    def lines(self, since_s: float = 0.0, name: str = "base") -> list[tuple[float, bool]]:
        whole, _, _ = self.file.read_text().rpartition("\n")
        rows = [line.split() for line in whole.splitlines()]
        return [
            (float(at_s), any(map(float, speeds)))
            for drive, at_s, *speeds in rows
            if drive == name and float(at_s) >= since_s
        ]

    def speeds_mps(self, since_s: float, name: str = "base") -> list[float]:
        """How fast it was told to drive."""
        whole, _, _ = self.file.read_text().rpartition("\n")
        rows = [line.split() for line in whole.splitlines()]
        return [float(linear) for drive, at_s, linear, _ in rows if drive == name and float(at_s) >= since_s]

    def moves(self, since_s: float = 0.0) -> list[float]:
        """When it was told to move."""
        return [at_s for at_s, is_move in self.lines(since_s) if is_move]

    def stands(self) -> bool:
        return not self.lines()[-1:] or not self.lines()[-1][1]

    def stopped_s(self, since_s: float) -> float:
        """When it was first told to stand after ``since_s``, which it was: wait for that before."""
        return min(at_s for at_s, is_move in self.lines(since_s) if not is_move)

    def has_stopped(self, since_s: float) -> bool:
        return any(not is_move for _, is_move in self.lines(since_s))

    def silence_s(self) -> float:
        """From the last command that moved it to the standstill after it."""
        last_s = self.moves()[-1]
        return self.stopped_s(last_s) - last_s


@dataclass
class Site:
    """A server and a robot in the lab, and operators who join them."""

    lab: Lab
    url: str
    account: dict[str, str]
    robot: Process
    track: Track

    def on_operators_side(self, body: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Runs ``body`` on an event loop in the operator's network."""
        self.lab.operator.run(lambda: asyncio.run(body()))

    @asynccontextmanager
    async def connected(
        self, email: str | None = None, password: str | None = None, *, is_person: bool = True, **options: Any
    ) -> AsyncIterator[RobotConnection]:
        """Somebody at the robot; without an account its owner, who is a supervisor."""
        token = await self._token(email or self.account["email"], password or self.account["password"])
        async with MosaicOperator(self.url, token, is_person=is_person, **options) as operator:
            yield await operator.connect(self.account["robotId"], timeout_s=20)

    async def colleague(self, role: str) -> tuple[str, str]:
        """E-mail and password of a new account that has this role on the robot."""
        token = await self._token(self.account["email"], self.account["password"])
        email = f"{role}-{next(_numbers)}@example.org"
        async with AsyncClient(base_url=self.url, headers={"Authorization": f"Bearer {token}"}) as http:
            made = await http.post("/api/v1/users", json={"email": email, "fullName": role.title()})
            account = made.raise_for_status().json()["resultData"]
            path = f"/api/v1/robots/{self.account['robotId']}/grants/{account['id']}"
            (await http.put(path, json={"role": role})).raise_for_status()
        return email, account["password"]

    async def _token(self, email: str, password: str) -> str:
        async with await MosaicOperator.login(self.url, email, password) as signed_in:
            return signed_in.access_token

    @asynccontextmanager
    async def driving(self, connection: RobotConnection, label: str = "cmd_vel") -> AsyncIterator[None]:
        """Commands 20 times a second, whatever happens; the robot moves. Until it does, every tenth command lets go:
        after a stop nothing moves before that."""
        pad = connection.sendable(label)
        await pad.wait_open()
        start_s = time.monotonic()

        async def drive() -> None:
            for number in count():
                is_letting_go = number % 10 == 0 and not self.track.moves(start_s)
                pad.send_json(STANDING if is_letting_go else TWIST)
                await asyncio.sleep(0.05)

        task = asyncio.create_task(drive())
        try:
            await until(lambda: len(self.track.moves(start_s)) >= 3, "the robot moves")
            yield
        finally:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
