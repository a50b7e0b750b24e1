"""Models the params of MQTT connectors: which broker, and who we are there."""

from __future__ import annotations

from typing import Any, Literal
from urllib.parse import SplitResult, urlsplit

from pydantic import Field, SecretStr, ValidationError, field_validator, model_validator

from mosaic_core.contract.described_message import CommandField, message_of
from mosaic_core.contract.made_message import check_names
from mosaic_core.contract.params import Params
from mosaic_core.words.wire_model import told_mistakes

FAKE = "fake"
_PORTS = {"mqtt": 1883, "mqtts": 8883}


class BrokerParams(Params):
    """Names a broker, and how it knows us."""

    broker: str = Field(
        default="mqtt://127.0.0.1",
        description="`mqtt://host:1883`, `mqtts://host:8883` with TLS, or `fake` to try it without a broker.",
    )
    username: str | None = Field(default=None, description="The name that the broker knows.")
    password: SecretStr | None = Field(default=None, description="Its password; write ${MQTT_PASSWORD}.")
    ca_file: str | None = Field(
        default=None, description="Certificates in PEM that vouch for the broker; default: those of the system."
    )
    keepalive_s: int = Field(default=10, ge=2, le=3600, description="Silence after which the connection is tried.")
    max_bytes: int = Field(
        default=65_536, ge=256, le=1_048_576, description="Largest message, with topic; larger ones stay away."
    )

    @field_validator("broker")
    @classmethod
    def _is_an_address(cls, broker: str) -> str:
        if broker == FAKE:
            return broker
        wrong = "no broker's address; write mqtt://host:1883, mqtts://host:8883 or fake"
        try:
            parts = urlsplit(broker)
            is_whole = parts.scheme in _PORTS and bool(parts.hostname) and parts.port != 0
        except ValueError:
            raise ValueError(wrong) from None
        if not is_whole or parts.path.strip("/") or parts.query or parts.fragment:
            raise ValueError(wrong)
        if parts.username is not None:
            raise ValueError("credentials do not belong in the address; write username and password")
        return broker

    @model_validator(mode="after")
    def _fits_together(self) -> BrokerParams:
        if self.password is not None and self.username is None:
            raise ValueError("a password needs a username")
        if self.ca_file is not None and not self.is_encrypted:
            raise ValueError("ca_file is for mqtts:// only")
        return self

    @property
    def _parts(self) -> SplitResult:
        return urlsplit(self.broker)

    @property
    def is_encrypted(self) -> bool:
        """Whether the broker is spoken to by TLS."""
        return self._parts.scheme == "mqtts"

    @property
    def host(self) -> str:
        """The broker's name or address."""
        return self._parts.hostname or ""

    @property
    def port(self) -> int:
        """The broker's TCP port."""
        return self._parts.port or _PORTS[self._parts.scheme]


class SubscribeParams(BrokerParams):
    topic: str = Field(
        min_length=1, max_length=1024, description="A topic, or a filter: `+` is any level, `#` at the end any rest."
    )
    format: Literal["json", "text", "bytes"] = Field(
        default="json",
        description="`json`: objects with topic and value; `text` and `bytes`: the payload alone.",
    )
    qos: Literal[0, 1] = Field(default=0, description="1: what is lost on the way to us is sent again.")

    @field_validator("topic")
    @classmethod
    def _is_a_filter(cls, topic: str) -> str:
        levels = topic.split("/")
        if "\0" in topic or "#" in levels[:-1] or any(len(one) > 1 and set(one) & set("+#") for one in levels):
            raise ValueError("no topic filter: + and # stand alone between slashes, and # is the last")
        return topic


MAX_FIELDS = 64


class PublishParams(BrokerParams):
    topic: str = Field(min_length=1, max_length=1024, description="The topic that the commands are published under.")
    fields: dict[str, CommandField] = Field(
        min_length=1, max_length=MAX_FIELDS, description="The keys of a command; each command has all of them."
    )
    payload: Literal["json", "value"] = Field(
        default="json",
        description="`json`: an object with these keys; `value`: of a single key the value alone.",
    )
    safe: dict[str, float | bool | str] = Field(
        default={},
        description="What the safe command says beside 0 for each velocity of `fields`. It needs all of the rest.",
    )
    qos: Literal[0, 1] = Field(default=0, description="1: what is lost on the way to the broker is sent again.")
    retain: bool = Field(default=False, description="The broker keeps the last command for who subscribes later.")

    @field_validator("topic")
    @classmethod
    def _is_a_topic(cls, topic: str) -> str:
        if set(topic) & set("+#\0"):
            raise ValueError("a topic that is published under has no + and no #")
        return topic

    @model_validator(mode="after")
    def _is_consistent(self) -> PublishParams:
        check_names(self.fields)
        if self.payload == "value" and len(self.fields) != 1:
            raise ValueError("payload: value is for a single key in `fields`; write json")
        unknown = [key for key in self.safe if key not in self.fields]
        if unknown:
            raise ValueError(f"safe: {', '.join(unknown)}: not among the fields")
        if self.safe_command is None and self.moves:
            missing = [key for key, field in self.fields.items() if field.kind != "velocity"]
            raise ValueError(f"what moves needs a safe command: `safe` lacks {', '.join(missing)}")
        return self

    @property
    def moves(self) -> bool:
        """Whether a command moves something."""
        return any(field.kind is not None for field in self.fields.values())

    @property
    def safe_command(self) -> dict[str, Any] | None:
        """The command that brings whoever listens into a safe state, if there is one. Raises :class:`ValueError`."""
        zeros = {key: 0.0 for key, field in self.fields.items() if field.kind == "velocity"}
        safe = {**zeros, **self.safe}
        if not self.safe and len(zeros) < len(self.fields):
            return None
        try:
            return message_of("Safe", self.fields).model_validate(safe).model_dump(mode="json")
        except ValidationError as error:
            raise ValueError(f"safe: {told_mistakes(error)}") from None
