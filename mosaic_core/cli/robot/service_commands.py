"""``mosaic service``: a robot that starts with its machine."""

from __future__ import annotations

import grp
import os
import pwd
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_core.cli.terminal.error_report import report_problems, usage
from mosaic_core.words.errors import ConfigError, by_line

if TYPE_CHECKING:
    from mosaic_core.runtime.configuration.checked_config import Validation

app = typer.Typer(add_completion=False, no_args_is_help=True, help="A robot that starts with its machine.")

DEVICE_GROUPS = ("video", "render", "audio", "dialout", "i2c", "gpio", "spi", "input", "bluetooth")
"""Groups of device files on Debian, Ubuntu, Raspberry Pi OS and Jetson Linux; named are those that are here."""
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")


@app.callback()
def service() -> None:
    """A robot that starts with its machine."""


@app.command("print")
def print_unit(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")],
    run_words: Annotated[
        list[str] | None, typer.Argument(metavar="[-- WORDS]", help="Options for `mosaic run`, such as `-- --serve`.")
    ] = None,
    user: Annotated[
        bool, typer.Option("--user", help="A service of your own account, which needs no root and gets no priority.")
    ] = False,
    account: Annotated[str, typer.Option(help="Who the robot runs as; default: you, and never root unasked.")] = "",
    name: Annotated[str, typer.Option(help="The service's name.")] = "mosaic",
    secrets: Annotated[
        Path | None,
        typer.Option(help="The folder of its secrets; default /etc/mosaic, with --user ~/.config/mosaic."),
    ] = None,
) -> None:
    """Print the systemd service file for a robot on this machine.

    It names this installation, the file, the account, the groups of devices that are here, and for each
    `${credential:NAME}` of the file a secret. Checks the file first, as a service sees it; writes nothing.
    """
    from mosaic_core.cli.robot.service_unit import ServiceUnit, unit_text
    from mosaic_core.runtime.configuration.config_env import references_in

    if not _NAME.fullmatch(name):
        usage(f"--name {name!r}: letters, digits, '-', '_' and '.' do")
    if str(config).startswith("-"):
        usage(f"name the robot's file before `--`: mosaic service print mosaic_config.yaml -- {config}")
    words = _run_words(run_words or [])
    validation = _validated(config, words)
    references = references_in(validation.document.secret.values())
    owner = "" if user else _account(account)
    if user and account:
        usage("--user is a service of your own account; leave out --account")
    home_secrets = Path.home() / ".config" / "mosaic"
    unit = ServiceUnit(
        name=name,
        account=owner,
        groups=_groups_here(),
        folder=config.absolute().parent,
        command=(*_program(), "run", str(config.absolute()), *words),
        secrets=(secrets.absolute() if secrets else home_secrets if user else Path("/etc/mosaic")),
        credentials=references.credentials,
        variables=references.variables,
    )
    typer.echo(unit_text(unit), nl=False)


def _run_words(words: list[str]) -> list[str]:
    """As ``mosaic run`` itself would read them; ends with its message where it would not."""
    from mosaic_core.cli.robot.metrics_option import metrics_address
    from mosaic_core.cli.robot.run_options import app as run_app
    from mosaic_core.cli.robot.run_options import wish_of

    command = typer.main.get_command(run_app)
    given = command.make_context("mosaic run", ["mosaic_config.yaml", *words]).params
    wish_of(given["serve"], given["name"], given["tls_cert"], given["tls_key"], widgets=given["widgets"])
    if given["metrics"] is not None:
        metrics_address(given["metrics"], is_public=given["metrics_public"])
    if given["reload"]:
        usage("--reload is for a terminal: a service that runs code as soon as it changes is not one to stand beside")
    return words


def _validated(config: Path, words: list[str]) -> Validation:
    """Raises :class:`ConfigError` with every mistake. Secrets that only the service has are forgiven."""
    from mosaic_core.cli.configuration.local_option import resolver_beside
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer

    configurer = AutoConfigurer(resolver=resolver_beside(config, "--local-connectors" in words))
    validation, rehearsal = configurer.rehearse_file(config, allow_missing_env=True)
    problems = (*validation.problems, *rehearsal.problems)
    if problems:
        raise ConfigError(problems)
    serves = any(word.partition("=")[0] == "--serve" for word in words)  # which the hint of no server asks for
    hints = by_line((*validation.hints, *rehearsal.hints))
    report_problems([one for one in hints if one.path or not serves], as_hints=True)
    return validation


def _account(wanted: str) -> str:
    if not wanted:
        if os.geteuid() == 0:
            usage("a robot needs no root: say who it runs as, --account NAME")
        return pwd.getpwuid(os.geteuid()).pw_name
    try:
        return pwd.getpwnam(wanted).pw_name
    except KeyError:
        usage(f"no account {wanted!r} on this machine; `sudo adduser {wanted}` makes one")


def _groups_here() -> tuple[str, ...]:
    known = {one.gr_name for one in grp.getgrall()}
    return tuple(name for name in DEVICE_GROUPS if name in known)


def _program() -> tuple[str, ...]:
    """This installation's `mosaic`; its links are kept, because they make the virtual environment."""
    beside = Path(sys.executable).with_name("mosaic")
    return (str(beside),) if beside.is_file() else (sys.executable, "-m", "mosaic_core.cli.main")
