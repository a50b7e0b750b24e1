"""``mosaic validate``: every mistake of a robot's YAML file at once, and who shares a lease with whom."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.configuration.local_option import LocalOption, resolver_beside
from mosaic_core.cli.terminal.error_report import FINE, USAGE, report_problems
from mosaic_core.words.errors import ConfigError, by_line, untold


def validate(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")] = Path("mosaic_config.yaml"),
    as_json_text: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    allow_missing_env: Annotated[
        bool, typer.Option(help="Forgive environment variables and secret files that only exist on the robot.")
    ] = False,
    local_connectors: LocalOption = None,
) -> None:
    """Check a robot's YAML file: every mistake at once. Starts nothing and opens no device."""
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer

    leases: Mapping[str, Sequence[str]] = {}
    try:
        resolver = resolver_beside(config, local_connectors)
        configurer = AutoConfigurer(resolver=resolver)
        validation, rehearsal = configurer.rehearse_file(config, allow_missing_env=allow_missing_env)
        problems = by_line((*validation.problems, *rehearsal.problems))
        unused = untold(resolver.local.problems, problems)
        hints = (*unused, *by_line((*validation.hints, *rehearsal.hints)))
        leases = rehearsal.leases
    except ConfigError as error:
        problems, hints = error.problems, ()
    if as_json_text:
        found = {"problems": [*map(asdict, problems)], "hints": [*map(asdict, hints)], "leases": leases}
        typer.echo(json.dumps({"valid": not problems, **found}))
    else:
        report_problems(hints, as_hints=True)
        for resource, labels in leases.items() if len(leases) > 1 else ():
            typer.echo(f"lease '{resource}': {', '.join(labels)}")
        if problems:
            report_problems(problems)
        else:
            typer.echo(f"{config}: valid")
    raise typer.Exit(USAGE if problems else FINE)
