"""Finds the ES modules in which installed distributions ship widgets, without importing any of their code.

An entry point of the group ``mosaic.widgets`` names one: ``acme-arm = "acme_arm.widgets"`` is the file
``acme_arm/widgets/acme-arm.js`` of its distribution. A robot announces its hash; a server on which the same
distribution is installed serves the same bytes.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path

from mosaic_core.words.catalogue import MAX_WIDGET_MODULE_BYTES, WidgetModule
from mosaic_core.words.errors import MosaicError, PluginError, hint_at

GROUP = "mosaic.widgets"
_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")
_FOLDER = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
_EXPORT = re.compile(r"[A-Za-z_$][\w$]*")
_DECLARED = re.compile(r"\bexport\s+(?:async\s+)?(?:function|class|const|let|var)\s+([\w$]+)")
_LISTED = re.compile(r"\bexport\s*\{([^}]*)\}")
_UNCLEAR = re.compile(r"\bexport\s*(?:\*|(?:const|let|var)\s*(?:[\[{]|[^;\n]*,))")
"""Exports whose names a glance does not tell."""
_PLAIN_VALUE = re.compile(r"""\bexport\s+(?:const|let|var)\s+([\w$]+)\s*=\s*(-?[\d.]+|['"`\[]|true\b|false\b|null\b)""")
"""What can be no component."""


@dataclass(frozen=True, slots=True)
class FoundModule:
    """A module with its bytes, as they were when it was found."""

    announced: WidgetModule
    path: Path
    content: bytes


def is_shipped(hint: str) -> bool:
    """Whether a handler's ``widget`` names one that a distribution ships, ``module/Export``, and no stock one."""
    return "/" in hint


def announced_module(hint: str | None) -> WidgetModule | None:
    """What the catalogue says of the module; ``None`` for a stock widget, and where :func:`module_with` has a
    complaint, which the check of the configuration tells."""
    if hint is None or not is_shipped(hint):
        return None
    try:
        return module_with(hint).announced
    except MosaicError:
        return None


def module_with(hint: str, not_installed: Sequence[EntryPoint] = ()) -> FoundModule:
    """The module of ``acme-arm/ArmPanel``; ``not_installed``: those of a source tree that can be imported, whatever is
    installed of it. Raises :class:`MosaicError` (``config.broken_plugin``) where no distribution has it, several have,
    its file is missing or can't be served, or nothing in it is called like that."""
    name, _, export = hint.partition("/")
    if not _EXPORT.fullmatch(export):
        cure = "write module/Export, such as acme-arm/ArmPanel"
        raise MosaicError(f"{export!r} can't be exported by a module", code="config.broken_plugin", cure=cure)
    found = read_module(_point(name, not_installed))
    lacking = lacking_export(found.content.decode(), export)
    if lacking:
        message = f"{found.path} of {_source(found.announced)} {lacking}"
        raise MosaicError(message, code="config.broken_plugin", cure="export it, or name another")
    return found


def lacking_export(text: str, export: str) -> str:
    """What is wrong with the component ``export`` of the module ``text``, as a verb and what belongs to it; empty where
    it is there, or a glance does not tell."""
    exports = exports_of(text)
    if export not in exports and not is_unclear(text):
        return f"exports no '{export}'{hint_at(export, exports)}".rstrip(".")
    plain = {name for name, _ in _PLAIN_VALUE.findall(text)}
    return f"exports '{export}' as a plain value, which is no component" if export in plain else ""


def is_unclear(text: str) -> bool:
    """Whether a module exports something whose name a glance does not tell."""
    return _UNCLEAR.search(text) is not None


def installed_modules() -> Iterator[FoundModule | PluginError]:
    """Every module of every distribution, by name; an error in the place of one that can't be served."""
    for point in sorted(entry_points(group=GROUP), key=lambda one: (one.name, one.value)):
        try:
            yield read_module(point)
        except PluginError as error:
            yield error


def read_module(point: EntryPoint) -> FoundModule:
    """The module that an entry point names. Raises :class:`PluginError` with distribution, path and cause."""
    distribution, version = _identity(point)
    source = f"{distribution} {version}".strip()
    if not _NAME.fullmatch(point.name) or not _FOLDER.fullmatch(point.value):
        message = f"{source} says {point.name} = {point.value!r}, which is no module name and the package of its file"
        raise _broken(source, message, 'write for example acme-arm = "acme_arm.widgets"')
    path = _file_of(point)
    try:
        size_bytes = path.stat().st_size
        content = path.read_bytes() if size_bytes <= MAX_WIDGET_MODULE_BYTES else b""
        content.decode()
    except FileNotFoundError as error:
        cure = f"build it, and let the wheel carry the folder {point.value.replace('.', '/')}"
        raise _broken(source, f"{source} has no file {path}", cure) from error
    except (OSError, UnicodeDecodeError) as error:
        raise _broken(source, f"{path} of {source} can't be read: {error}", "mend the file") from error
    if size_bytes > MAX_WIDGET_MODULE_BYTES:
        most = f"{MAX_WIDGET_MODULE_BYTES // 1024} KiB"
        raise _broken(source, f"{path} of {source} has more than {most}", "leave out what it does not need")
    sha256 = hashlib.sha256(content).hexdigest()
    announced = WidgetModule(
        name=point.name, distribution=distribution, version=version, sha256=sha256, size_bytes=len(content)
    )
    return FoundModule(announced, path, content)


def exports_of(text: str) -> set[str]:
    """The names that a module exports, as far as a glance at its text tells."""
    listed = [part for group in _LISTED.findall(text) for part in group.split(",")]
    return {*_DECLARED.findall(text), *(part.split()[-1] for part in listed if part.strip())}


def _point(name: str, not_installed: Sequence[EntryPoint]) -> EntryPoint:
    points = entry_points(group=GROUP)
    instead = {point.value for point in not_installed}
    others = (point for point in points if point.value not in instead)
    claims: list[EntryPoint] = [point for point in (*others, *not_installed) if point.name == name]
    if not claims:
        message = f"no installed distribution ships widgets as '{name}'{hint_at(name, points.names)}".rstrip(".")
        cure = f'install the one that does, or name its file: [project.entry-points."{GROUP}"]'
        raise MosaicError(message, code="config.broken_plugin", cure=cure)
    if len(claims) > 1:
        names = " and ".join(sorted(" ".join(_identity(one)).rstrip() for one in claims))
        message = f"the widgets '{name}' are claimed by {names}"
        raise MosaicError(message, code="config.broken_plugin", cure="uninstall one of them")
    return claims[0]


def _identity(point: EntryPoint) -> tuple[str, str]:
    """Name and version of its distribution; one with broken metadata has neither."""
    metadata = point.dist.metadata if point.dist else {"Name": None, "Version": None}
    return metadata["Name"] or point.value, metadata["Version"] or ""


def _file_of(point: EntryPoint) -> Path:
    """Among the installed files; where the distribution is installed from its sources, beside its package's code.
    The package is only looked for, never imported."""
    top, *below = point.value.split(".")
    inside = Path(*below, f"{point.name}.js")
    installed = Path(str(point.dist.locate_file(Path(top, inside)))) if point.dist else Path(top, inside)
    if installed.is_file():
        return installed
    spec = find_spec(top)
    places = [Path(place, inside) for place in (spec.submodule_search_locations or ())] if spec else []
    # Where nobody has the file, its author is told the place beside the code: metadata may lie anywhere.
    return next((place for place in places if place.is_file()), places[0] if places else installed)


def _source(module: WidgetModule) -> str:
    return f"{module.distribution} {module.version}".strip()


def _broken(source: str, message: str, cure: str) -> PluginError:
    error = PluginError(message, distribution=source)
    error.cure = cure
    return error
