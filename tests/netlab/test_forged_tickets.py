"""A ticket that was tampered with on its way lets nobody in, and the robot goes on serving those with a true one."""

from __future__ import annotations

import asyncio
import base64
import json
import random
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from mosaic_core.operator import MosaicOperator
from mosaic_core.words.errors import ConnectionFailed

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(120)]

Forgery = Callable[[str, random.Random], Any]


def encoded(part: Any) -> str:
    return base64.urlsafe_b64encode(json.dumps(part).encode()).decode().rstrip("=")


def with_claims(ticket: str, **changes: Any) -> str:
    """Other claims under the old signature."""
    header, _, signature = ticket.split(".")
    return ".".join((header, encoded({**claims_of(ticket), **changes}), signature))


def claims_of(ticket: str) -> dict[str, Any]:
    claims: dict[str, Any] = jwt.decode(ticket, options={"verify_signature": False})
    return claims


def self_signed(ticket: str, **changes: Any) -> str:
    """By somebody who has a key, but not the server's; under the name of the server's."""
    kid = jwt.get_unverified_header(ticket)["kid"]
    return jwt.encode({**claims_of(ticket), **changes}, Ed25519PrivateKey.generate(), "EdDSA", headers={"kid": kid})


def flipped(ticket: str, chance: random.Random) -> str:
    """One bit of what counts: the last character of a part may hold bits that mean nothing."""
    part = chance.randrange(3)
    texts = ticket.split(".")
    raw = bytearray(base64.urlsafe_b64decode(texts[part] + "=" * (-len(texts[part]) % 4)))
    raw[chance.randrange(len(raw))] ^= 1 << chance.randrange(8)
    texts[part] = base64.urlsafe_b64encode(bytes(raw)).decode().rstrip("=")
    return ".".join(texts)


FORGERIES: dict[str, Forgery] = {
    "a role raised by hand": lambda ticket, _: with_claims(ticket, role="supervisor"),
    "no signature": lambda ticket, _: ".".join((*ticket.split(".")[:2], "")),
    "the algorithm none": lambda ticket, _: f"{encoded({'alg': 'none', 'kid': 'x'})}.{encoded(claims_of(ticket))}.",
    "another key": lambda ticket, _: self_signed(ticket),
    "another key, and more rights": lambda ticket, _: self_signed(ticket, role="supervisor", exp=4e9),
    "an HMAC with a public word": lambda ticket, _: jwt.encode(
        claims_of(ticket), "public" * 8, "HS256", headers={"kid": jwt.get_unverified_header(ticket)["kid"]}
    ),
    "half of it": lambda ticket, _: ticket[: len(ticket) // 2],
    "nothing": lambda ticket, _: "",
    "no text": lambda ticket, _: {"role": "supervisor"},
    "dots": lambda ticket, _: "..",
    "very long": lambda ticket, _: ticket * 20,
    **{f"a flipped bit, {number}": flipped for number in range(12)},
}


class Tamperer:
    """Between the robot and its server, on a thread of its own: forges tickets while it has a forgery."""

    def __init__(self, server_port: int) -> None:
        self.forgery: Forgery | None = None
        self.forged = 0
        self.port = 0
        self._chance = random.Random(5)
        self._server_port = server_port
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._run(),), daemon=True)

    def start(self) -> None:
        self._thread.start()
        assert self._ready.wait(10)

    def stop(self) -> None:
        self._loop.call_soon_threadsafe(self._done.set)
        self._thread.join(10)
        self._loop.close()

    async def _run(self) -> None:
        self._done = asyncio.Event()
        async with serve(self._relay, "127.0.0.1", 0, max_size=None) as listening:
            self.port = next(iter(listening.sockets)).getsockname()[1]
            self._ready.set()
            await self._done.wait()

    async def _relay(self, robot: ServerConnection) -> None:
        assert robot.request is not None
        async with connect(f"ws://127.0.0.1:{self._server_port}{robot.request.path}", max_size=None) as server:
            up = asyncio.create_task(self._carry(robot, server, lambda text: text))
            await self._carry(server, robot, self._tampered)
            up.cancel()
            with suppress(asyncio.CancelledError):
                await up

    @staticmethod
    async def _carry(source: Any, target: Any, changed: Callable[[Any], Any]) -> None:
        with suppress(ConnectionClosed):
            async for text in source:
                await target.send(changed(text))

    def _tampered(self, text: Any) -> Any:
        message = json.loads(text)
        if self.forgery is None or not (message.get("data") or {}).get("ticket"):
            return text
        message["data"]["ticket"] = self.forgery(message["data"]["ticket"], self._chance)
        self.forged += 1
        return json.dumps(message)


@pytest.fixture(scope="module")
def tamperer(server: Any, seed: Any) -> Iterator[Tamperer]:
    between = Tamperer(server.port)
    between.start()
    yield between
    between.stop()


@pytest.fixture(scope="module")
def robot(start_robot: Any, server: Any, tamperer: Tamperer) -> Any:
    """A robot that takes the tamperer for its server."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(server, "port", tamperer.port)
        return start_robot("  - { type: connection-check, label: link }\n")


async def test_a_forged_ticket_lets_nobody_in_and_a_true_one_still_does(
    server: Any, seed: Any, robot: Any, tamperer: Tamperer
) -> None:
    async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
        for name, forgery in FORGERIES.items():
            tamperer.forgery, before = forgery, tamperer.forged
            with pytest.raises(ConnectionFailed) as refused:
                await operator.connect(seed.robot_id, timeout_s=10)
            assert tamperer.forged > before, name
            assert refused.value.code in {"auth.bad_ticket", "auth.forbidden"}, (name, refused.value)
        tamperer.forgery = None
        connection = await operator.connect(seed.robot_id, timeout_s=10)
        assert connection.state == "connected"
