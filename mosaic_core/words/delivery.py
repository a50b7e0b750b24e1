"""Models ``delivery:`` of a connector in the YAML file, and what a handler may choose for itself."""

from __future__ import annotations

from typing import Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mosaic_core.words.data_type import Delivery
from mosaic_core.words.wire_model import ConfigModel


class DeliveryContract(ConfigModel):
    """The way in which data travels, and its bounds; a mode alone (``latest``) is the short form of it.

    What is left out is the connector's own choice if the mode stays, and otherwise what the mode usually has.
    """

    mode: Delivery | None = Field(
        default=None,
        description="`reliable`: ordered and complete; `latest`: the newest value only; `bulk`: complete, behind "
        "everything else.",
    )
    queue_messages: int | None = Field(
        default=None,
        ge=1,
        le=65_536,
        description="Most messages that wait for one operator: 512 for `reliable`, 64 for `bulk`, always 1 for "
        "`latest`.",
    )
    queue_bytes: int | None = Field(
        default=None,
        ge=1024,
        le=256 * 1024 * 1024,
        description="Most bytes that wait for one operator: 2 MiB for `reliable`, 32 MiB for `bulk`. One message is "
        "always taken while nothing waits.",
    )
    max_rate_hz: float | None = Field(
        default=None,
        gt=0,
        le=10_000,
        description="Most messages per second to everybody. Of values the newest within the period goes out, other "
        "messages are refused to their sender; answers to one operator do not count.",
    )
    latch: bool | None = Field(
        default=None, description="Whoever joins late gets the last message at once; default: all but `bulk` do."
    )
    newest_wins: bool | None = Field(
        default=None,
        description="A newer message pushes the oldest out of a full queue, of 1 message if `queue_messages` does not "
        "say more. Always so for `latest`, off by default for `bulk`.",
    )

    @model_validator(mode="before")
    @classmethod
    def _short_form(cls, data: object) -> object:
        return {"mode": data} if isinstance(data, str) else data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Editors shall complete either form."""
        long_form: dict[str, Any] = handler.resolve_ref_schema(handler(schema))
        modes = {"enum": [str(mode) for mode in Delivery], "type": "string"}
        return {"anyOf": [modes, long_form], "description": long_form.get("description", "")}
