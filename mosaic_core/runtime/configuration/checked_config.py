"""Declares the result of checking a configuration: its connectors with valid params, its problems and its hints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.configurer import Configurer
from mosaic_core.contract.params import Params
from mosaic_core.runtime.configuration.resolver import InstalledConnector
from mosaic_core.runtime.configuration.yaml_document import Place, YamlDocument
from mosaic_core.words.config import ConnectorConfig, RobotConfig, SafetyConfig
from mosaic_core.words.errors import NOWHERE, CodeLine, ConfigError, Problem


@dataclass(frozen=True, slots=True)
class CheckedConnector:
    """A connector whose params and safety are valid, and where it stands in the file."""

    config: ConnectorConfig
    configurer: type[Configurer[Any]]
    params: Params
    safety: SafetyConfig
    installed: InstalledConnector
    place: Place
    document: YamlDocument

    @property
    def written_label(self) -> str:
        """Its label as the file has it: what comes from the environment or a file may be a secret, put there by
        mistake."""
        return self.document.secret.get((*self.place, "label"), self.config.label)

    @property
    def whose(self) -> str:
        """The connector and who ships it, as messages begin that speak of its code."""
        return f"connector '{self.config.label}' of {self.installed.source}"

    def problem(
        self, message: str, *key: str, code: str = "config.invalid", cure: str = "", guess: str = ""
    ) -> Problem:
        """A problem of this connector, at ``key`` where one is named; see :meth:`YamlDocument.problem`."""
        return self.document.problem((*self.place, *key), message, code=code, cure=cure, guess=guess)

    def broken(self, message: str, *, cure: str = "", at: CodeLine = NOWHERE) -> Problem:
        """What its author did wrong, not who wrote the file; ``at``: where."""
        return self.document.problem(self.place, message, code="config.broken_plugin", cure=cure, at=at)


@dataclass(frozen=True, slots=True)
class CheckedConfig:
    """A configuration without mistakes."""

    config: RobotConfig
    connectors: tuple[CheckedConnector, ...]
    hints: tuple[Problem, ...] = ()


@dataclass(frozen=True, slots=True)
class Validation:
    """All that can be said about a configuration without making its handlers.

    ``checked`` is ``None`` if there are problems, or if the values of missing environment variables were forgiven:
    nothing can be started from it then. ``connectors`` are those without a mistake whose values are all known, also
    beside mistakes elsewhere.
    """

    problems: tuple[Problem, ...]
    hints: tuple[Problem, ...]
    checked: CheckedConfig | None
    document: YamlDocument
    connectors: tuple[CheckedConnector, ...]

    def sound(self) -> CheckedConfig:
        """What can be started from it. Raises :class:`ConfigError` with its problems."""
        if self.checked is None:
            raise ConfigError(self.problems)
        return self.checked
