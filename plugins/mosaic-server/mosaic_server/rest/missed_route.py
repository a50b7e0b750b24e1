"""Answers a request that met no route: whether the path is wrong or the method, and the nearest path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from starlette.routing import compile_path

LONGEST_SHOWN = 200


@dataclass(frozen=True, slots=True)
class MissedRoute:
    status: int
    code: str
    message: str
    headers: dict[str, str] | None = None


def missed_route(paths: Mapping[str, Mapping[str, Any]], method: str, path: str) -> MissedRoute:
    """``paths``: those of the OpenAPI document. The dashboard answers any GET, so that the status says nothing."""
    served = sorted({verb.upper() for known, verbs in paths.items() if _fits(known, path) for verb in verbs})
    shown = path[:LONGEST_SHOWN]
    if served and method not in served:
        message = f"{shown} takes {' or '.join(served)}, not {method}"
        return MissedRoute(405, "rest.wrong_method", message, {"Allow": ", ".join(served)})
    near = _nearest(paths, path)
    guess = f"; did you mean {near}?" if near else ""
    return MissedRoute(404, "rest.unknown_path", f"there is nothing at {shown}{guess}")


def _fits(known: str, path: str) -> bool:
    return compile_path(known)[0].match(path) is not None


def _nearest(known: Iterable[str], path: str) -> str | None:
    """Without a trailing slash and with the version that every path has, which are what people leave out."""
    tail = path[:LONGEST_SHOWN].rstrip("/").lower().removeprefix("/api").removeprefix("/v1")
    return next(iter(get_close_matches(f"/api/v1{tail}", known, 1, 0.75)), None)
