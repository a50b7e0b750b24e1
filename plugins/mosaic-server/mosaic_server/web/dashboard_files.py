"""Serves the built dashboard, compressed: hashed assets for ever, everything else fresh, unknown pages as
``index.html``."""

from __future__ import annotations

from mimetypes import guess_type
from pathlib import Path

from fastapi import APIRouter, HTTPException, Request
from starlette.responses import FileResponse, HTMLResponse, Response

from mosaic_server.web.accepted_encoding import accepts

_MISSING = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>MOSAIC</title>
<style>body{font-family:system-ui,sans-serif;max-width:40rem;margin:4rem auto;padding:0 1rem;line-height:1.5}
code{background:#8883;padding:.1em .3em;border-radius:.2em}</style>
<h1>The server runs, its dashboard is not built</h1>
<p>This is an installation from source. Build the dashboard with <code>npm ci &amp;&amp; npm run build</code> in
<code>dashboard/</code>, or start everything with <code>./dev demo</code>; then reload this page.</p>
<p>Robots and programs can connect already: the REST interface is described in
<a href="/openapi.json">/openapi.json</a>.</p>
</html>
"""
_ENCODINGS = {"br": ".br", "gzip": ".gz"}
"""What the build wrote beside each text, the smaller first."""


def dashboard_router(directory: Path) -> APIRouter:
    """The last router: it answers every GET that nobody else did."""
    router = APIRouter(include_in_schema=False)
    root = directory.resolve()

    @router.get("/{path:path}")
    def file(path: str, request: Request) -> Response:
        if path.startswith(("api/", "ws/")):
            raise HTTPException(404)
        index = root / "index.html"
        if not index.is_file():
            return HTMLResponse(_MISSING, status_code=503, headers={"Cache-Control": "no-store"})
        wanted = _file_in(root, path)
        if wanted is not None:
            return _answer(wanted, _caching(path), request)
        if "." in path.rsplit("/", 1)[-1]:
            raise HTTPException(404)  # a missing file, not a page of the application
        return _answer(index, "no-cache", request)

    return router


def _file_in(root: Path, path: str) -> Path | None:
    try:
        wanted = (root / path).resolve()
        return wanted if wanted.is_relative_to(root) and wanted.is_file() else None
    except (OSError, ValueError):  # too long, or with a NUL: no file is called that
        return None


def _answer(wanted: Path, caching: str, request: Request) -> FileResponse:
    """The file as it was built, or compressed where the browser takes that; no cache may mix them up."""
    headers = {"Cache-Control": caching, "Vary": "Accept-Encoding"}
    accepted = request.headers.get("accept-encoding", "")
    for encoding, suffix in _ENCODINGS.items():
        compressed = wanted.with_name(wanted.name + suffix)
        if accepts(accepted, encoding) and compressed.is_file():
            headers["Content-Encoding"] = encoding
            return FileResponse(compressed, headers=headers, media_type=guess_type(wanted.name)[0])
    return FileResponse(wanted, headers=headers)


def _caching(path: str) -> str:
    """Vite puts a hash of the content into the name of everything under ``assets/``."""
    return "public, max-age=31536000, immutable" if path.startswith("assets/") else "no-cache"
