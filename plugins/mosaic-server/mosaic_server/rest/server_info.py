"""Tells anybody what may be known of this server."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter
from pydantic import Field

from mosaic_core.words.signaling import EXTENSIONS
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import Envelope
from mosaic_server.rest.signed_in import ServicesDep

router = APIRouter(tags=["server"])


class ServerInfo(WireModel):
    name: str
    version: str
    extensions: dict[str, int]
    signup: bool
    pairs_with: str | None = Field(default=None, description="The one robot that devices are paired with here.")


@router.get("/api/v1/server")
async def server_info(services: ServicesDep) -> Envelope[ServerInfo]:
    """Public."""
    return Envelope(
        resultData=ServerInfo(
            name="mosaic-server",
            version=version("mosaic-server"),
            extensions=EXTENSIONS,
            signup=services.settings.allow_signup,
            pairs_with=services.settings.pairs_with,
        )
    )


@router.get("/healthz")
async def health() -> dict[str, str]:
    """Public: the process serves requests."""
    return {"status": "ok"}
