"""The application: routes, sockets, guards and the dashboard around one set of services."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache
from importlib.metadata import version

from fastapi import FastAPI
from starlette.middleware.cors import CORSMiddleware
from starlette.responses import JSONResponse, Response
from starlette.routing import BaseRoute

from mosaic_server.rest import (
    account,
    audit,
    connections,
    connector_configs,
    grants,
    members,
    organization,
    pairing,
    robot_check,
    robots,
    server_info,
    users,
    widget_modules,
)
from mosaic_server.rest.envelope import Failure, install_error_handlers
from mosaic_server.rest.original import occupancy_maps, organization_users, robot_auth, tabs
from mosaic_server.services import running
from mosaic_server.settings import Settings
from mosaic_server.web import socket_routes, widget_files
from mosaic_server.web.dashboard_files import dashboard_router
from mosaic_server.web.forwarded_requests import ForwardedRequests
from mosaic_server.web.guards import Guards


def create_app(settings: Settings) -> FastAPI:
    """An ASGI application. Its sockets need :class:`mosaic_server.sockets.link.LinkedProtocol` (see ``serving``)."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with running(settings) as services:
            app.state.services = services
            yield

    app = FastAPI(
        title="MOSAIC server",
        version=version("mosaic-server"),
        lifespan=lifespan,
        openapi_url=None,  # it would write the same text anew for everybody who asks
        docs_url=None,  # these pages load scripts from strangers
        redoc_url=None,
    )
    install_error_handlers(app)
    app.router.routes.extend(_routes_of_every_server())

    @cache
    def description() -> bytes:
        return bytes(JSONResponse(app.openapi()).body)

    @app.get("/openapi.json", include_in_schema=False)
    async def described() -> Response:
        return Response(description(), media_type="application/json")

    app.include_router(dashboard_router(settings.dashboard_dir))
    if settings.allowed_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=sorted(settings.allowed_origins),
            allow_methods=["GET", "POST", "PUT", "DELETE"],
            allow_headers=["Authorization", "Content-Type"],
        )
    app.add_middleware(Guards, settings=settings)
    app.add_middleware(ForwardedRequests, settings=settings)  # the last one added comes first
    return app


@cache
def _routes_of_every_server() -> list[BaseRoute]:
    """Routes find the services in the application that was asked, and hold none of them: servers of one program share
    what FastAPI makes of them at the first request, which takes 50 ms."""
    of_accounts = (account, users, members, organization, organization_users, pairing, audit)
    of_robots = (robots, robot_auth, connector_configs, robot_check, grants, connections)
    of_pages = (server_info, widget_modules)
    of_originals = (tabs, occupancy_maps)
    every = FastAPI(
        openapi_url=None, responses={400: {"model": Failure}, 401: {"model": Failure}, 403: {"model": Failure}}
    )
    for routes in (*of_accounts, *of_robots, *of_pages, *of_originals):
        every.include_router(routes.router)
    every.include_router(socket_routes.router)
    every.include_router(widget_files.router)
    return every.routes
