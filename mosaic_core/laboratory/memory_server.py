"""A server in memory: it introduces one robot to any number of operators and knows no accounts.

An operator's access token is its name. For tests of robots and operators, not of servers.
"""

from __future__ import annotations

import asyncio
import base64
import json
import time
import uuid
from collections.abc import AsyncIterator, Mapping
from typing import Any
from urllib.parse import urlsplit

import httpx
import jwt
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from mosaic_core.words import signaling
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import RobotStatus, SignalingMessage

TICKET_LIFE_S = 60
KEY_ID = "memory"
PING_PERIOD_S = 5.0
BASE_URL = "http://memory.invalid"


class MemorySocket:
    """The robot's or an operator's socket to the server in memory; a ``TextSocket``."""

    def __init__(self, server: MemoryServer, is_robot: bool) -> None:
        self.is_robot = is_robot
        self.name = ""
        self.close_code: int | None = None
        self._server = server
        self._frames: asyncio.Queue[str | None] = asyncio.Queue()

    def push(self, message: SignalingMessage) -> None:
        self._frames.put_nowait(message.to_text())

    async def __aiter__(self) -> AsyncIterator[str]:
        while (text := await self._frames.get()) is not None:
            yield text

    async def send(self, text: str) -> None:
        self._server.heard(self, signaling.parse_signaling(text))

    async def close(self, code: int = 1000, reason: str = "") -> None:
        if self.close_code is None:
            self.close_code = code
            self._frames.put_nowait(None)
            self._server.closed(self)


class MemoryServer:
    """Signaling and the REST routes that an operator needs."""

    def __init__(self, robot_id: str, robot_ice_servers: tuple[IceServer, ...] = ()) -> None:
        self.robot_id = robot_id
        self._robot_ice_servers = robot_ice_servers
        self.status = RobotStatus.DISCONNECTED
        self.catalogue: Catalogue | None = None
        self.roles: dict[str, str] = {}
        """What the tickets of these operators say; ``operator`` for all others."""
        self._robot: MemorySocket | None = None
        self._operators: list[MemorySocket] = []
        self._peers: dict[str, MemorySocket] = {}
        self._key = Ed25519PrivateKey.generate()

    async def connect(self, url: str) -> MemorySocket:
        """Implements ``SocketConnector``."""
        socket = MemorySocket(self, urlsplit(url).path.endswith("/ws/robot"))
        socket.push(signaling.AuthorizeRequest(extensions=signaling.EXTENSIONS))
        return socket

    async def keep_alive(self) -> None:
        """Run beside the test: robots and operators take a silent server for a dead one."""
        while True:
            await asyncio.sleep(PING_PERIOD_S)
            for socket in (self._robot, *self._operators):
                if socket is not None:
                    socket.push(signaling.PingPing(ping_id=str(uuid.uuid4())))

    def http(self) -> httpx.MockTransport:
        return httpx.MockTransport(self._respond)

    def heard(self, socket: MemorySocket, message: SignalingMessage) -> None:
        match message:
            case signaling.Authorize():
                self._authorized(socket, message)
            case signaling.StatusUpdate(status=status):
                self.status = status
                self._tell_operators(signaling.StatusUpdate(robot_id=self.robot_id, status=status))
            case signaling.CatalogueAnnounce(catalogue=catalogue):
                self.catalogue = catalogue
                self._tell_operators(signaling.CatalogueUpdate(robot_id=self.robot_id, catalogue=catalogue))
            case signaling.StatusSubscribe():
                socket.push(signaling.StatusUpdate(robot_id=self.robot_id, status=self.status))
            case signaling.SdpOffer(rtc_connection_id=peer_id):
                self._peers[peer_id] = socket
                self._relay(socket, message, peer_id)
            case (
                signaling.SdpAnswer(rtc_connection_id=peer_id)
                | signaling.ExchangeIceCandidate(rtc_connection_id=peer_id)
                | signaling.ClosePeerConnection(rtc_connection_id=peer_id)
            ):
                self._relay(socket, message, peer_id)

    def closed(self, socket: MemorySocket) -> None:
        if socket is self._robot:
            self._robot = None
            self.heard(socket, signaling.StatusUpdate(status=RobotStatus.DISCONNECTED))
        elif socket in self._operators:
            self._operators.remove(socket)

    def _authorized(self, socket: MemorySocket, message: signaling.Authorize) -> None:
        socket.name = message.access_token or ""
        if socket.is_robot:
            self._robot = socket
        else:
            self._operators.append(socket)
        socket.push(signaling.AuthorizeResult(code=100))
        public = base64.urlsafe_b64encode(self._key.public_key().public_bytes_raw()).decode().rstrip("=")
        keys = (signaling.TicketKey(kid=KEY_ID, x=public),)
        welcome = signaling.SessionWelcome(
            server="memory",
            extensions=message.extensions or {},
            ice_servers=self._robot_ice_servers if socket.is_robot else (),
            keys=keys,
        )
        socket.push(welcome)

    def _relay(self, sender: MemorySocket, message: SignalingMessage, peer_id: str) -> None:
        receiver = self._peers.get(peer_id) if sender.is_robot else self._robot
        if receiver is not None:
            receiver.push(message)

    def _tell_operators(self, message: SignalingMessage) -> None:
        for operator in self._operators:
            operator.push(message)

    def _respond(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path
        if path.endswith("/ice-servers"):
            return httpx.Response(200, json=[])
        name = request.headers.get("Authorization", "").removeprefix("Bearer ")
        if path.endswith("/connection"):
            result: Any = self._new_connection(name, json.loads(request.content))
        elif path.endswith("/catalogue"):
            result = self.catalogue.wire() if self.catalogue else None
        else:
            result = {"data": [{"id": self.robot_id, "name": "robot", "status": int(self.status)}], "count": 1}
        return httpx.Response(200, json={"resultCode": 100, "resultData": result})

    def _new_connection(self, name: str, body: Mapping[str, Any]) -> dict[str, Any]:
        peer_id, session_id = str(uuid.uuid4()), body.get("sessionId") or str(uuid.uuid4())
        if self._robot is not None:
            prepare = signaling.PrepareConnection(
                rtc_connection_id=peer_id,
                session_id=session_id,
                operator=signaling.OperatorIdentity(id=name, name=name),
                ticket=self._ticket(name, peer_id, session_id),
            )
            self._robot.push(prepare)
        return {"sessions": [{"robotId": self.robot_id, "rtcSessionId": peer_id, "sessionId": session_id}]}

    def _ticket(self, name: str, peer_id: str, session_id: str) -> str:
        now = int(time.time())
        claims = {
            "sub": name, "name": name, "role": self.roles.get(name, "operator"), "robotId": self.robot_id,
            "peerId": peer_id, "sessionId": session_id, "iat": now, "exp": now + TICKET_LIFE_S,
        }  # fmt: skip
        return jwt.encode(claims, self._key, algorithm="EdDSA", headers={"kid": KEY_ID})
