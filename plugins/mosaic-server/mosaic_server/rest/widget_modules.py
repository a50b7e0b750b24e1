"""Tells which modules of widgets this server serves, for pages to compare with what a robot announces."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import Field

from mosaic_core.words.catalogue import WidgetModule
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import Envelope
from mosaic_server.rest.signed_in import PersonDep, ServicesDep

router = APIRouter(tags=["server"])


class WidgetOffer(WireModel):
    is_on: bool = Field(description="False: the server was started with --no-widgets.")
    modules: tuple[WidgetModule, ...] = Field(description="Each at `/widgets/SHA256.js`.")


@router.get("/api/v1/widgets")
async def widget_modules(services: ServicesDep, person: PersonDep) -> Envelope[WidgetOffer]:
    """The modules of widgets of the plugins that are installed on the server."""
    return Envelope(resultData=WidgetOffer(is_on=services.widgets.is_open, modules=services.widgets.offered))
