"""The tabs of original dashboards: pages of widgets that everybody in the organization shares."""

from __future__ import annotations

import json

from fastapi import APIRouter
from pydantic import Field

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.rest.envelope import ApiError, Created, DoneMessage, Envelope
from mosaic_server.rest.signed_in import OperatorDep, PersonDep, ServicesDep
from mosaic_server.rest.texts import NAME, NO_NUL
from mosaic_server.storage.tabs import MOST_TABS, TooManyTabs, add_tab, change_tab, remove_tab, tab_of, tabs_of

router = APIRouter(prefix="/api/v1/dashboard/tabs", tags=["tabs of original dashboards"])


class TabName(WireModel):
    name: str = Field(min_length=1, max_length=200, pattern=NAME)


class ListedTab(WireModel):
    id: str
    name: str


class TabDto(ListedTab):
    """A tab of an original dashboard. ``widgets``: the JSON text that was stored as ``tabConfig``."""

    widgets: str


class TabConfig(WireModel):
    """The widgets of an original dashboard's tab: ``{"widgets": […]}`` as a JSON text."""

    tab_config: str = Field(max_length=500_000, pattern=NO_NUL)


@router.get("")
async def list_tabs(person: PersonDep, services: ServicesDep) -> Envelope[list[ListedTab]]:
    """Oldest first."""
    found = await services.database.run(tabs_of, person.organization_id)
    return Envelope(resultData=[ListedTab(id=tab_id, name=name) for tab_id, name in found])


@router.post("")
async def create_tab(new: TabName, person: OperatorDep, services: ServicesDep) -> Envelope[Created]:
    """An empty one."""
    try:
        tab_id = await services.database.run(add_tab, person.organization_id, new.name)
    except TooManyTabs as error:
        message = f"an organization has at most {MOST_TABS} tabs"
        raise ApiError(ResultCode.INVALID_FORMAT, message, code="signal.too_many", status=409) from error
    return Envelope(resultData=Created(message="tab created", id=tab_id))


@router.get("/{tab_id}")
async def show_tab(tab_id: str, person: PersonDep, services: ServicesDep) -> Envelope[TabDto]:
    tab = await services.database.run(tab_of, person.organization_id, tab_id)
    if tab is None:
        raise _unknown()
    return Envelope(resultData=TabDto(id=tab.id, name=tab.name, widgets=tab.tab_config))


@router.put("/{tab_id}")
async def rename_tab(tab_id: str, change: TabName, person: OperatorDep, services: ServicesDep) -> Envelope[DoneMessage]:
    if not await services.database.run(change_tab, person.organization_id, tab_id, name=change.name):
        raise _unknown()
    return Envelope(resultData=DoneMessage(message="tab saved"))


@router.put("/{tab_id}/configs")
async def arrange_tab(
    tab_id: str, change: TabConfig, person: OperatorDep, services: ServicesDep
) -> Envelope[DoneMessage]:
    """Kept as it came; what is in it is the dashboard's business."""
    _must_be_object(change.tab_config)
    if not await services.database.run(change_tab, person.organization_id, tab_id, tab_config=change.tab_config):
        raise _unknown()
    return Envelope(resultData=DoneMessage(message="tab saved"))


@router.delete("/{tab_id}")
async def delete_tab(tab_id: str, person: OperatorDep, services: ServicesDep) -> Envelope[DoneMessage]:
    if not await services.database.run(remove_tab, person.organization_id, tab_id):
        raise _unknown()
    return Envelope(resultData=DoneMessage(message="tab removed"))


def _must_be_object(text: str) -> None:
    try:
        is_object = isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        is_object = False
    if not is_object:
        raise ApiError(ResultCode.INVALID_FORMAT, 'tabConfig is a JSON text: {"widgets": […]}')


def _unknown() -> ApiError:
    # In the original this number is ROBOT_NOT_FOUND's, too.
    return ApiError(ResultCode.ROBOT_NOT_FOUND, code="signal.unknown_tab", name="TAB_NOT_FOUND")
