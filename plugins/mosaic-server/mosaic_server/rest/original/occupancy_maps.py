"""Occupancy maps of original dashboards: a picture of where a robot can go, and the text that says where it lies."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field, TypeAdapter, ValidationError
from starlette.datastructures import FormData, UploadFile
from starlette.requests import ClientDisconnect

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.wire_model import WireModel
from mosaic_server.occupancy_map_files import BadMapFile, MapFile, pgm_file, yaml_file, zipped
from mosaic_server.rest.envelope import MAX_SKIP, ApiError, Created, DoneMessage, Envelope, iso_time
from mosaic_server.rest.signed_in import OperatorDep, PersonDep, ServicesDep
from mosaic_server.rest.texts import NAME
from mosaic_server.services import Services
from mosaic_server.storage.accounts import Person
from mosaic_server.storage.occupancy_maps import (
    MOST_BYTES,
    MOST_MAPS,
    MapRecord,
    TooManyMaps,
    add_map,
    map_files_of,
    map_of,
    maps_of,
    remove_map,
)

router = APIRouter(prefix="/api/v1/occupancy_map", tags=["occupancy maps of original dashboards"])

_UPLOAD: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["name", "pgm_file", "yaml_file"],
                    "properties": {
                        "name": {"type": "string"},
                        "pgm_file": {"type": "string", "format": "binary"},
                        "yaml_file": {"type": "string", "format": "binary"},
                    },
                }
            }
        },
    }
}
_NAME: TypeAdapter[str] = TypeAdapter(Annotated[str, Field(min_length=1, max_length=200, pattern=NAME)])


class OccupancyMapDto(WireModel):
    """An occupancy map, as original dashboards read it. ``pgmFilePath`` and ``yamlFilePath`` are the files' names;
    there is no path.
    """

    id: str
    name: str
    pgm_file_path: str
    yaml_file_path: str
    created_at: str
    updated_at: str


class OccupancyMapPage(WireModel):
    data: list[OccupancyMapDto]
    count: int


@router.get("")
async def list_maps(
    person: PersonDep,
    services: ServicesDep,
    skip: Annotated[int, Query(ge=0, le=MAX_SKIP)] = 0,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> Envelope[OccupancyMapPage]:
    """Oldest first."""
    page, count = await services.database.run(maps_of, person.organization_id, skip, limit)
    return Envelope(resultData=OccupancyMapPage(data=[_dto(one) for one in page], count=count))


@router.post("", openapi_extra=_UPLOAD)
async def create_map(request: Request, person: OperatorDep, services: ServicesDep) -> Envelope[Created]:
    """``multipart/form-data``. The body is read after the account is known: nobody else can send files."""
    name, pgm, yaml = await _uploaded(request)
    try:
        map_id = await services.database.run(add_map, person.organization_id, name, pgm, yaml)
    except TooManyMaps as error:
        message = f"an organization has at most {MOST_MAPS} maps, of {MOST_BYTES} bytes together"
        raise ApiError(ResultCode.INVALID_FORMAT, message, code="signal.too_many", status=409) from error
    return Envelope(resultData=Created(message="map created", id=map_id))


@router.get("/{map_id}")
async def show_map(map_id: str, person: PersonDep, services: ServicesDep) -> Envelope[OccupancyMapDto]:
    found = await services.database.run(map_of, person.organization_id, map_id)
    if found is None:
        raise ApiError(ResultCode.OCCUPANCY_MAP_NOT_FOUND)
    return Envelope(resultData=_dto(found))


@router.delete("/{map_id}")
async def delete_map(map_id: str, person: OperatorDep, services: ServicesDep) -> Envelope[DoneMessage]:
    if not await services.database.run(remove_map, person.organization_id, map_id):
        raise ApiError(ResultCode.OCCUPANCY_MAP_NOT_FOUND)
    return Envelope(resultData=DoneMessage(message="map removed"))


@router.get("/{map_id}/pgm", response_class=Response)
async def send_pgm(map_id: str, person: PersonDep, services: ServicesDep) -> Response:
    pgm, _ = await _files(services, person, map_id)
    return _download(pgm, "application/octet-stream")


@router.get("/{map_id}/yaml", response_class=Response)
async def send_yaml(map_id: str, person: PersonDep, services: ServicesDep) -> Response:
    _, yaml = await _files(services, person, map_id)
    return _download(yaml, "application/x-yaml")


@router.get("/{map_id}/download", response_class=Response)
async def send_both(map_id: str, person: PersonDep, services: ServicesDep) -> Response:
    """Both files as a zip archive."""
    files = await _files(services, person, map_id)
    return _download(MapFile("map.zip", await asyncio.to_thread(zipped, files)), "application/zip")


async def _uploaded(request: Request) -> tuple[str, MapFile, MapFile]:
    try:
        async with request.form(max_files=2, max_fields=1, max_part_size=1024) as form:
            name = _name_in(form)
            pgm = pgm_file(*await _file_in(form, "pgm_file"))
            yaml = yaml_file(*await _file_in(form, "yaml_file"))
    except (BadMapFile, ClientDisconnect) as error:
        raise ApiError(ResultCode.INVALID_FORMAT, str(error) or "the upload ended early") from error
    return name, pgm, yaml


async def _files(services: Services, person: Person, map_id: str) -> tuple[MapFile, MapFile]:
    files = await services.database.run(map_files_of, person.organization_id, map_id)
    if files is None:
        raise ApiError(ResultCode.OCCUPANCY_MAP_NOT_FOUND)
    return files


def _download(file: MapFile, media_type: str) -> Response:
    """Never shown in place: the file is a stranger's."""
    headers = {"Content-Disposition": f'attachment; filename="{file.name}"'}
    return Response(file.content, media_type=media_type, headers=headers)


def _name_in(form: FormData) -> str:
    try:
        return _NAME.validate_python(form.get("name"))
    except ValidationError as error:
        raise ApiError(ResultCode.INVALID_FORMAT, "name is a text of 1 to 200 characters") from error


async def _file_in(form: FormData, part: str) -> tuple[str | None, bytes]:
    file = form.get(part)
    if not isinstance(file, UploadFile):
        raise ApiError(ResultCode.INVALID_FORMAT, f"the file {part} is missing")
    return file.filename, await file.read()


def _dto(one: MapRecord) -> OccupancyMapDto:
    return OccupancyMapDto(
        id=one.id,
        name=one.name,
        pgm_file_path=one.pgm_name,
        yaml_file_path=one.yaml_name,
        created_at=iso_time(one.created_at_ms),
        updated_at=iso_time(one.updated_at_ms),
    )
