"""The ``http-poller`` connector: JSON that an HTTP server answers with, asked for again and again."""

from __future__ import annotations

import math
from collections.abc import AsyncGenerator
from typing import Annotated, Any, ClassVar

import httpx
from pydantic import Field, StringConstraints, ValidationError, field_validator, model_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.described_message import DescribedField, message_of
from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.made_message import check_names, with_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.wire_model import told_mistakes
from mosaic_host.web.json_body import JsonPage
from mosaic_host.web.pointer import MAX_POINTER, checked_pointer, part_of

FAKE = "fake"
MAX_FIELDS = 64
HeaderText = Annotated[str, StringConstraints(max_length=4096, pattern=r"^[\x20-\x7e]*$")]
HeaderName = Annotated[str, StringConstraints(max_length=64, pattern=r"^[A-Za-z0-9-]+$")]


class PolledField(DescribedField):
    """One key of the message."""

    pointer: str | None = Field(
        default=None, max_length=MAX_POINTER, description="Where it is: a JSON Pointer; default: / and its name."
    )

    @field_validator("pointer")
    @classmethod
    def _is_pointer(cls, pointer: str | None) -> str | None:
        return None if pointer is None else checked_pointer(pointer)


class HttpPollerParams(Params):
    url: str = Field(max_length=2048, description="http:// or https://; `fake`: a server that is made up, to try it.")
    period_s: float = Field(default=1.0, ge=0.1, le=86_400, description="Seconds between two questions.")
    timeout_s: float = Field(default=2.0, gt=0, le=60, description="Seconds for a whole answer.")
    max_bytes: int = Field(default=65_536, ge=2, le=1_048_576, description="Larger answers are refused.")
    headers: dict[HeaderName, HeaderText] = Field(
        default={}, max_length=16, description="Sent along, such as Authorization: ${credential:NAME}."
    )
    pointer: str = Field(
        default="", max_length=MAX_POINTER, description="The part that is meant: a JSON Pointer; default: all of it."
    )
    fields: dict[str, PolledField] = Field(
        default={},
        max_length=MAX_FIELDS,
        description="The keys of the message, found in the part that is meant; default: that object as it is.",
    )

    @field_validator("url")
    @classmethod
    def _can_be_asked(cls, url: str) -> str:
        if url == FAKE:
            return url
        try:
            parsed = httpx.URL(url)
        except httpx.InvalidURL as error:
            raise ValueError(f"no URL: {error}") from None
        if parsed.scheme not in ("http", "https") or not parsed.host:
            raise ValueError("no URL of a server; write http://host:port/path, or `fake`")
        return url

    @model_validator(mode="after")
    def _is_consistent(self) -> HttpPollerParams:
        checked_pointer(self.pointer)
        check_names(self.fields)
        return self


class HttpPoller(DataChannelSendable[Any]):
    """Asks on the event loop; sends a message per answer. What is no message counts as refused."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: HttpPollerParams, model: type[Message] | None = None) -> None:
        super().__init__(label)
        self.params = params
        self._model = model
        self._refusals = RefusedInput(self)

    async def messages(self) -> AsyncGenerator[Any, None]:
        """Raises :class:`DeviceGone`."""
        if self.params.url == FAKE:
            async for tick in self.every(self.params.period_s):
                yield self._message(_made_up(self.params, tick))
            return
        params = self.params
        page = JsonPage(params.url, params.headers, params.max_bytes, params.timeout_s)
        async with page.client() as client:
            async for _ in self.every(params.period_s):
                try:
                    message = self._message(await page.ask(client))
                except (ValueError, LookupError) as error:
                    why = told_mistakes(error, 1) if isinstance(error, ValidationError) else error
                    self._refusals.add(f"an answer of {page.shown}", why)
                else:
                    yield message

    def _message(self, value: Any) -> Any:
        part = part_of(value, self.params.pointer)
        if self._model is None:
            if not isinstance(part, dict):
                raise ValueError(f"a JSON {type(part).__name__} where an object is expected")
            return part
        pointers = {key: f"/{key}" if one.pointer is None else one.pointer for key, one in self.params.fields.items()}
        return self._model.model_validate({key: part_of(part, pointer) for key, pointer in pointers.items()})


def _made_up(params: HttpPollerParams, tick: int) -> Any:
    """What a server that is made up answers: the fields, where they are looked for."""
    at_s = tick * params.period_s
    made_up = {"number": round(math.sin(at_s), 3), "integer": tick, "boolean": tick % 2 == 0, "text": FAKE}
    whole: Any = {"uptime_s": at_s}
    for key, one in params.fields.items():
        pointer = f"/{key}" if one.pointer is None else one.pointer
        _put(whole, params.pointer + pointer, made_up[one.type])
    if not params.fields:
        _put(whole, params.pointer + "/uptime_s", at_s)
    return whole


def _put(whole: dict[str, Any], pointer: str, value: Any) -> None:
    *folders, last = [token.replace("~1", "/").replace("~0", "~") for token in pointer.split("/")[1:]]
    for folder in folders:
        whole = whole.setdefault(folder, {})
    whole[last] = value


class HttpPollerConfigurer(DataChannelConfigurer[HttpPollerParams]):
    """JSON that an HTTP server answers with, asked for again and again."""

    connector_type = "http-poller"
    example: ClassVar[dict[str, Any] | None] = {
        "url": "http://127.0.0.1:8080/status",
        "fields": {"charge": {"unit": "%", "pointer": "/battery/charge"}},
    }
    trial: ClassVar[dict[str, Any] | None] = {"url": "fake", "fields": {"charge": {"pointer": "/battery/charge"}}}

    def configure(self) -> HttpPoller:
        if not self.params.fields:
            return HttpPoller(self.label, self.params)
        model = message_of("PolledAnswer", self.params.fields)
        return with_message(HttpPoller, model, DataChannelSendable)(self.label, self.params, model)
