"""Models the params that every connector of a vehicle has: the link, and which vehicle on it."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, SecretStr

from mosaic_core.contract.params import Params
from mosaic_mavlink.link.address import SPELLINGS, link_address
from mosaic_mavlink.link.codec import Dialect


def _spelt(url: str) -> str:
    link_address(url)
    return url


class VehicleParams(Params):
    """Connectors whose link params are the same share one link."""

    url: Annotated[str, AfterValidator(_spelt)] = Field(description=f"The link: {SPELLINGS}.")
    baud: int = Field(default=57_600, ge=1200, le=4_000_000, description="Of a serial line, in bits per second.")
    system_id: int = Field(default=0, ge=0, le=255, description="Of the vehicle; 0: the first autopilot that is heard.")
    component_id: int = Field(default=1, ge=1, le=255, description="Of its autopilot.")
    own_system_id: int = Field(
        default=255, ge=1, le=255, description="Ours, as a ground station; ArduPilot's SYSID_MYGCS must name it."
    )
    own_component_id: int = Field(default=190, ge=1, le=255, description="Ours.")
    dialect: Dialect = Field(default="ardupilotmega", description="Which messages are known; all speak MAVLink 2.")
    heartbeat_timeout_s: float = Field(
        default=3.0, ge=1.2, le=60, description="Silence after which the vehicle is gone; it should beat once a second."
    )
    signing_key: SecretStr = Field(
        default=SecretStr(""),
        description="64 hexadecimal digits or a passphrase; write ${file:/run/secrets/mavlink}. Empty: not signed.",
    )


class TelemetryParams(VehicleParams):
    """A vehicle, and how often it shall tell something."""

    period_s: float = Field(default=0.1, ge=0.02, le=60, description="Seconds between two messages, asked of it.")
