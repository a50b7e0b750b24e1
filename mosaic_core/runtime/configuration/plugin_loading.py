"""Imports the configurer of one plugin and checks that it keeps the contract."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pkgutil import iter_modules
from typing import Any

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.contract.declared.code_lines import code_of, standing_at
from mosaic_core.contract.params import Params
from mosaic_core.runtime.configuration.local_connectors import LocalConnector
from mosaic_core.runtime.threads.code_places import explained_error, is_own, raised_at
from mosaic_core.runtime.threads.slow_code import told_when_slow
from mosaic_core.words.config import LABEL, SafetyConfig
from mosaic_core.words.errors import NOWHERE, CodeLine, MosaicError, PluginError, guess


def load_configurer(
    entry_point: EntryPoint, source: str, local: LocalConnector | None, failed_imports: dict[str, BaseException]
) -> type[Configurer[Any]]:
    """Import a plugin that ``source`` ships and check that it keeps the contract; :class:`PluginError` otherwise, whose
    cause is the error of the import. ``local``: where it stands, if it is not installed. ``failed_imports``: modules
    that were tried for another type of theirs; their code is not run once more."""

    def broken(cause: str, cure: str | None = None, at: CodeLine = NOWHERE) -> PluginError:
        message = f"connector type '{entry_point.name}' of {source} can't be used: {cause}"
        code = "config.broken_plugin" if local is None else "config.broken_local"
        if cure is None and is_own(at.file):
            cure = "Mend the file that it names."  # whoever writes it has nothing to update
        return PluginError(message, distribution=source, code=code, cure=cure, at=at)

    if local is not None and local.unreadable is not None:
        at = CodeLine(local.unreadable.file, local.unreadable.line)
        raise broken(f"{at.heading}{local.unreadable.message}", at=at)
    if not entry_point.pattern.match(entry_point.value):  # nothing more can be asked of it
        raise broken(f"its entry point is '{entry_point.value}', which is no module:Class", _written_again(entry_point))
    error = failed_imports.get(entry_point.module)
    if error is None:
        try:  # an import may fail in any way, even by sys.exit()
            if local is not None:
                local.prepare()
            slow = told_when_slow(f"the import of connector type '{entry_point.name}' of {source}")
            with slow, redirect_stdout(sys.stderr):  # what it prints is not for who reads the command's output
                loaded = entry_point.load()
        except KeyboardInterrupt:
            raise
        except BaseException as raised:  # noqa: BLE001
            error = raised
            if entry_point.module not in sys.modules:
                failed_imports[entry_point.module] = error
    if error is not None:
        if local is not None:
            raise broken(*local.explained(error)) from error
        raise broken(*(missing_part(entry_point, error) or _explained(error))) from error
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        named = entry_point.value if local is None else f"{local.class_name}, line {local.line},"
        place = standing_at(loaded) if local is None else ""
        raise broken(f"{named} is not a Configurer class{place}", _configurer_instead(entry_point), code_of(loaded))
    _check(loaded, entry_point, broken)
    return loaded


def _explained(error: BaseException) -> tuple[str, str | None, CodeLine]:
    """What an import raised: the cause, the cure if the author of the error knows one, and where."""
    cure = error.cure if isinstance(error, MosaicError) else None
    return explained_error(error).removesuffix(cure or "").rstrip(), cure, raised_at(error)


def _check(loaded: type[Configurer[Any]], entry_point: EntryPoint, make_error: Callable[..., PluginError]) -> None:
    """Raises what ``make_error`` makes of a class that does not keep the contract."""

    def broken(cause: str, cure: str | None = None) -> PluginError:
        return make_error(f"{cause}{standing_at(loaded)}", cure, code_of(loaded))

    version = api_version(loaded)
    if version != API_VERSION:
        raise broken(f"it is written for API version {version}, this mosaic-core speaks {API_VERSION}")
    if not loaded.connector_type and entry_point.dist is not None:
        cure = f'write connector_type = "{entry_point.name}" in {loaded.__name__}, as its entry point is called'
        raise broken(f"{loaded.__name__} has no connector_type", cure)
    if loaded.connector_type != entry_point.name:
        cure = f'name both alike: connector_type = "{entry_point.name}", or the entry point'
        raise broken(f"{loaded.__name__} says that its connector_type is '{loaded.connector_type}' ({cure})")
    if not LABEL.match(loaded.connector_type):
        written = re.sub("[^a-z0-9]+", "-", loaded.connector_type.lower()).strip("-")
        cure = f'write connector_type = "{written}"' if written else "write it in kebab-case"
        raise broken(f"the connector_type of {loaded.__name__} is '{loaded.connector_type}', no name for a type", cure)
    missing = sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        cure = f"write {' and '.join(f'{name}(self)' for name in missing)} in {loaded.__name__}"
        raise broken(f"{loaded.__name__} does not implement {', '.join(missing)}", cure)
    model: object = loaded.params_model
    if not (isinstance(model, type) and issubclass(model, Params)):
        raise broken(f"the params_model of {loaded.__name__} is {model!r}, no subclass of Params")
    safety: object = loaded.safety_model
    if not (isinstance(safety, type) and issubclass(safety, SafetyConfig)):
        raise broken(f"the safety_model of {loaded.__name__} is {safety!r}, no subclass of SafetyConfig")
    for name in ("example", "trial"):
        if not isinstance(getattr(loaded, name), dict | None):
            raise broken(f"the {name} of {loaded.__name__} is no mapping of params")


def missing_part(entry_point: EntryPoint, error: BaseException) -> tuple[str, str, CodeLine] | None:
    """What of an entry point's module and class is not there, the cure, and the line that asks for it; ``None`` if both
    are."""
    again = _written_again(entry_point)
    if isinstance(error, ModuleNotFoundError) and error.name:
        if f"{entry_point.module}.".startswith(f"{error.name}."):
            cure = guess(entry_point.module, _modules_beside(entry_point.module))
            message = f"its entry point names the module '{error.name}', which is not installed"
            return message, _both(cure, again), NOWHERE
        at = raised_at(error)
        message = f"its module {entry_point.module} needs '{error.name}', which is not installed{at.in_brackets}"
        cure = f"install {error.name}, and name it among the dependencies of the distribution"
        return message, cure, at
    module, (name, *_) = sys.modules.get(entry_point.module), entry_point.attr.split(".")
    if isinstance(error, AttributeError) and module is not None and not hasattr(module, name):
        message = f"its entry point names '{name}', which the module {entry_point.module} does not have"
        return f"{message} ({module.__file__})", _both(_configurer_meant(entry_point), again), NOWHERE
    return None


def _written_again(entry_point: EntryPoint) -> str:
    written = f'{entry_point.name} = "{entry_point.value}"'
    return f"correct `{written}` among the entry points in its pyproject.toml, and install it again"


def _configurer_instead(entry_point: EntryPoint) -> str:
    """What to do about an entry point whose own class or function is none."""
    derive = "derive the class from DataChannelConfigurer or MediaTrackConfigurer, and write configure()"
    return _configurer_meant(entry_point, derive)


def _configurer_meant(entry_point: EntryPoint, otherwise: str = "it has no configurer") -> str:
    """The configurer of its module that an entry point probably means, or all of them; ``otherwise`` where there is
    none."""
    module = sys.modules.get(entry_point.module)
    known = [name for name, value in vars(module).items() if _is_configurer(value)] if module is not None else []
    return guess(entry_point.attr or "", known, f"it has: {', '.join(known)}" if known else otherwise)


def _both(cure: str, again: str) -> str:
    return f"{cure}; {again}" if cure else again


def _is_configurer(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, Configurer) and not value.__module__.startswith("mosaic_core.")


def _modules_beside(name: str) -> list[str]:
    """The modules of the package that should have the module ``name``."""
    package = name.rpartition(".")[0]
    spec = find_spec(package) if package.partition(".")[0] in sys.modules else None
    found = iter_modules(spec.submodule_search_locations) if spec is not None else ()
    return [f"{package}.{one.name}" for one in found]


def api_version(configurer: type) -> object:
    """``MOSAIC_API_VERSION`` of the configurer's module or of its top package; absent means ours."""
    for name in (configurer.__module__, configurer.__module__.partition(".")[0]):
        declared: object = getattr(sys.modules.get(name), "MOSAIC_API_VERSION", None)
        if declared is not None:
            return declared
    return API_VERSION
