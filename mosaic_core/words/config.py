"""Models the robot's YAML file; ``runtime.configuration.config_loader`` reads the file, here is only its meaning."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit
from uuid import UUID

from pydantic import AliasChoices, Field, SecretStr, field_validator, model_validator

from mosaic_core.words.delivery import DeliveryContract as DeliveryContract
from mosaic_core.words.ice import IceServer, IceTransportPolicy
from mosaic_core.words.safety_config import ControlConfig as ControlConfig
from mosaic_core.words.safety_config import SafetyConfig as SafetyConfig
from mosaic_core.words.wire_model import ConfigModel as ConfigModel

LABEL = re.compile(r"^[A-Za-z0-9][A-Za-z0-9_.:/-]{0,63}$")


class AuthParams(ConfigModel):
    """The secrets by which the robot proves its identity."""

    token: SecretStr | None = Field(default=None, description="The robot's token; write ${MOSAIC_TOKEN}.")


class AuthConfig(ConfigModel):
    """The robot's identity."""

    type: Literal["simple-token", "no-authorization"] = Field(description="How the robot proves who it is.")
    robot_id: UUID = Field(description="The robot's id, as the server shows it.")
    params: AuthParams = Field(default=AuthParams(), description="What it proves it with.")

    @field_validator("type", mode="before")
    @classmethod
    def _historic(cls, value: object) -> object:
        return "simple-token" if value == "token" else value

    @model_validator(mode="after")
    def _token_is_there(self) -> AuthConfig:
        if self.type == "simple-token" and not (self.params.token and self.params.token.get_secret_value()):
            raise ValueError("simple-token needs params.token; write token: ${MOSAIC_TOKEN}")
        return self


class WebrtcConfig(ConfigModel):
    """Settings of the robot's peer connections."""

    ice_servers: tuple[IceServer, ...] = Field(default=(), description="STUN and TURN servers beside the server's own.")
    ice_transport_policy: IceTransportPolicy = Field(
        default="all", description="relay: only paths through TURN, to test it or to hide this machine's addresses."
    )


class ServerConfig(ConfigModel):
    """The server of the robot: its URL and the robot's identity there."""

    ws_url: str = Field(
        description="The server, without a path: wss://mosaic.example.org", pattern=r"^wss?://[^/\s?#@]+/?$"
    )
    auth: AuthConfig = Field(
        validation_alias=AliasChoices("auth", "auth_config"), description="Which robot it is, and how it proves that."
    )
    webrtc: WebrtcConfig = Field(
        default=WebrtcConfig(),
        validation_alias=AliasChoices("webrtc", "webrtc_config"),
        description="How it finds a way to its operators.",
    )

    @field_validator("ws_url")
    @classmethod
    def _has_host_and_port(cls, url: str) -> str:
        """What the pattern can't say: brackets, port range."""
        try:
            parts = urlsplit(url)
            if parts.hostname and parts.port != 0:
                return url
        except ValueError:
            pass
        raise ValueError(f"{url!r} names no host, or a port that doesn't exist")


Label = Annotated[str, Field(pattern=LABEL.pattern, description="Name of the data channel or track; unique.")]


class ConnectorConfig(ConfigModel):
    """One connector. ``params`` is validated by its plugin."""

    type: str = Field(description="The connector type; `mosaic connectors list` shows those installed.")
    label: Label
    params: dict[str, Any] = Field(
        default_factory=dict, description="Settings of this connector; `mosaic connectors show TYPE` has them all."
    )
    delivery: DeliveryContract | None = Field(
        default=None, description="How the data travels: a mode, or more; default: the connector's own."
    )
    safety: dict[str, Any] | None = Field(default=None, description="Limits; validated by the connector's own model.")


class RobotConfig(ConfigModel):
    """The whole file."""

    version: Literal[1] = Field(default=1, description="Of this format; there is one.")
    server: ServerConfig | None = Field(
        default=None, description="Who introduces operators. Without it: `mosaic run --serve`, and the LAN alone."
    )
    control: ControlConfig = Field(default=ControlConfig(), description="Who may command.")
    connectors: tuple[ConnectorConfig, ...] = Field(default=(), description="What the robot sends, shows and takes.")

    @model_validator(mode="after")
    def _says_something(self) -> RobotConfig:
        if self.server is None and not self.connectors:
            raise ValueError("neither a server nor connectors: 'server' is missing")
        return self
