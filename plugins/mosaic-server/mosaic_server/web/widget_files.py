"""Serves the modules of widgets under the hash of their bytes: for ever the same, so that browsers keep them for ever.

Public, as the dashboard's own code is: a page's `import` carries no token.
"""

from __future__ import annotations

from fastapi import APIRouter, HTTPException, Request
from starlette.responses import Response

from mosaic_server.services import services_of
from mosaic_server.web.accepted_encoding import accepts

router = APIRouter(include_in_schema=False)

_HEADERS = {"Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}


@router.get("/widgets/{name:path}")
async def widget_file(name: str, request: Request) -> Response:
    """`SHA256.js` from the shelf; no path ever reaches the disk."""
    sha256, dot, ending = name.partition(".")
    module = services_of(request).widgets.module(sha256) if dot + ending == ".js" else None
    if module is None:
        raise HTTPException(404)
    if accepts(request.headers.get("accept-encoding", ""), "gzip"):
        headers = {**_HEADERS, "Content-Encoding": "gzip"}
        return Response(module.gzipped, headers=headers, media_type="text/javascript")
    return Response(module.content, headers=_HEADERS, media_type="text/javascript")
