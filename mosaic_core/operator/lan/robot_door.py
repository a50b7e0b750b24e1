"""Speaks REST to what may be a robot's own server, before and while this machine is paired with it.

Who answers may be anybody: answers are bounded in size and time, and no sign-in is shown before it is proved who asks.
"""

from __future__ import annotations

import asyncio
import json
import secrets
from typing import Any, TypeVar
from uuid import UUID

import httpx
from pydantic import Field, ValidationError, field_validator

from mosaic_core.machines.lan.announced_robots import LONGEST_NAME
from mosaic_core.machines.lan.pairing_proof import claims_of, is_proved
from mosaic_core.operator.lan.paired_robots import ACCESS_TOKEN, LONGEST_TOKEN
from mosaic_core.operator.signaling.rest_api import RobotSummary, refused, rest_client
from mosaic_core.words.errors import AuthError, MosaicError, SignalingError
from mosaic_core.words.wire_model import PlainText, WireModel

ANSWER_S = 5.0
"""For one request: a robot on this network is near."""
_LARGEST_ANSWER = 64 * 1024
_PAIRING = "/api/v1/pairing"
Model = TypeVar("Model", bound=WireModel)


class RobotServerInfo(WireModel):
    """What everybody may know of a robot's own server. ``pairs_with``: the robot's name; ``None`` on other servers."""

    pairs_with: PlainText | None = None


class DevicePaired(WireModel):
    """The sign-in that a robot's own server gives to a device, for good."""

    access_token: str = Field(max_length=LONGEST_TOKEN, pattern=ACCESS_TOKEN, repr=False)
    role: PlainText = Field(max_length=20)
    robot_id: str
    robot_name: PlainText

    @field_validator("robot_id")
    @classmethod
    def _is_uuid(cls, text: str) -> str:
        return str(UUID(text))

    @field_validator("robot_name")
    @classmethod
    def _is_short(cls, text: str) -> str:
        return text[:LONGEST_NAME]


class _Proof(WireModel):
    proof: str


class _Robots(WireModel):
    data: list[RobotSummary]


class RobotDoor:
    """One address of a robot's own server. ``certificate``: the only one to trust, as PEM; empty: those that an
    authority vouches for. Raises :class:`SignalingError` or :class:`AuthError`; use it as ``async with``."""

    def __init__(self, url: str, certificate: str = "", http: httpx.AsyncBaseTransport | None = None) -> None:
        self.url = url
        self.certificate = certificate
        self._client = rest_client(url, http, {"Accept-Encoding": "identity"}, certificate)

    async def __aenter__(self) -> RobotDoor:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._client.aclose()

    async def robot_name(self) -> str:
        """Of the robot that devices are paired with here; raises ``lan.not_found`` where it is no robot's server."""
        info = _read(RobotServerInfo, await self._ask("GET", "/api/v1/server"))
        if info.pairs_with is None:
            message = f"{self.url} is a MOSAIC server, but not a robot's own"
            raise SignalingError(message, code="lan.not_found", cure="Sign in there with an account.")
        return info.pairs_with[:LONGEST_NAME]

    async def pair(self, secret: dict[str, str], device: str) -> DevicePaired:
        """Raises ``auth.pairing`` for a wrong PIN or code, ``auth.pairing_locked`` after too many."""
        return _read(DevicePaired, await self._ask("POST", _PAIRING, body={**secret, "name": device}))

    async def proves(self, access_token: str) -> bool:
        """Whether who answers here gave this sign-in, of which only its claims are told."""
        nonce = secrets.token_hex(16)
        try:
            answer = await self._ask(
                "POST", f"{_PAIRING}/proof", body={"claims": claims_of(access_token), "nonce": nonce}
            )
        except MosaicError as error:
            if error.code == "signal.unreachable":
                raise
            return False
        return is_proved(access_token, nonce, _read(_Proof, answer).proof)

    async def current_name(self, access_token: str) -> str:
        """Of the robot, for who is signed in; raises :class:`AuthError` where that was revoked."""
        robots = _read(_Robots, await self._ask("GET", "/api/v1/robots", access_token=access_token)).data
        return robots[0].name[:LONGEST_NAME] if robots else ""

    async def unpair(self, access_token: str) -> None:
        await self._ask("DELETE", _PAIRING, access_token=access_token)

    async def _ask(
        self, method: str, path: str, *, body: dict[str, str] | None = None, access_token: str | None = None
    ) -> Any:
        headers = {} if access_token is None else {"Authorization": f"Bearer {access_token}"}
        try:
            async with (
                asyncio.timeout(ANSWER_S),
                self._client.stream(method, path, json=body, headers=headers) as response,
            ):
                content = _content(await self._bounded(response))
        except (httpx.TransportError, httpx.InvalidURL, TimeoutError) as error:
            why = str(error) or f"no answer within {ANSWER_S:.0f} s"
            raise SignalingError(f"{self.url} can't be reached: {why}", code="signal.unreachable") from error
        if response.is_success and "resultData" in content:
            return content["resultData"]
        raise _as_lock(refused(path, response.status_code, content), response.status_code)

    async def _bounded(self, response: httpx.Response) -> bytes:
        received = bytearray()
        async for chunk in response.aiter_raw():
            received += chunk
            if len(received) > _LARGEST_ANSWER:
                raise SignalingError(f"{self.url} answers more than a robot does", code="signal.bad_message")
        return bytes(received)


def _content(text: bytes) -> dict[str, Any]:
    try:
        content = json.loads(text)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _read(model: type[Model], data: Any) -> Model:
    try:
        return model.model_validate(data)
    except ValidationError:
        message = "What answers is no robot's own server."
        raise SignalingError(message, code="signal.bad_message") from None  # the cause quotes what may be a sign-in


def _as_lock(error: MosaicError, status: int) -> MosaicError:
    """Too many attempts from one address are the same to who pairs as too many PINs."""
    return AuthError(error.message, code="auth.pairing_locked") if status == 429 else error
