"""The options of an account, which every command of ``mosaic operator`` takes, and the session that they open."""

from __future__ import annotations

import inspect
import shlex
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeAlias

import typer
from typer.models import ArgumentInfo

if TYPE_CHECKING:
    from collections.abc import Awaitable

    from mosaic_core.operator import MosaicOperator

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help="Look at robots, and command them, from the terminal."
)

Work: TypeAlias = "Callable[[MosaicOperator], Awaitable[int]]"
"""What a command does once it is signed in; its result is the exit code."""

Server = Annotated[str, typer.Option(envvar="MOSAIC_SERVER", help="The server's address.")]
Email = Annotated[str, typer.Option(envvar="MOSAIC_EMAIL", help="The account to sign in with.")]
PasswordStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from stdin; else MOSAIC_PASSWORD, else it is asked.")
]
CODE_HELP = (
    "A one-time sign-in code instead of account and password, good for a minute: whoever is signed in gets one by "
    "POST /api/v1/account/one-time-code."
)
Code = Annotated[str, typer.Option(help=CODE_HELP)]
Lan = Annotated[
    bool,
    typer.Option("--lan", help="The robot that this machine is paired with, whatever account is named; see `pair`."),
]
Timeline = Annotated[bool, typer.Option("--timeline", help="At the end, show how the connection came up.")]
DEFAULT_SERVER = "http://127.0.0.1:9001"


def command(
    *,
    is_person: bool | None = False,
    has_timeline: bool = False,
    interrupted: str = "",
    group: typer.Typer = app,
) -> Callable[[Callable[..., Work]], Callable[..., NoReturn]]:
    """Make a command of a function that returns its work: signing in comes before it, signing off after it.

    The account's options stand behind the command's arguments, ``--timeline`` at the end. ``is_person``: somebody
    decides here, and programs give way to persons; ``None``: if this is a terminal. ``interrupted``: what Ctrl+C
    cuts short, which is a failure then. ``group``: another one than
    ``mosaic operator``, such as a plugin's.
    """

    def made(work_of: Callable[..., Work]) -> Callable[..., NoReturn]:
        def signed_in(
            *,
            context: typer.Context,
            server: Server = DEFAULT_SERVER,
            email: Email = "",
            password_stdin: PasswordStdin = False,
            code: Code = "",
            lan: Lan = False,
            timeline: Timeline = False,
            **words: Any,
        ) -> NoReturn:
            work = work_of(**words)
            from mosaic_core.cli.operator import operator_session as session  # loads WebRTC: only for who acts

            robot = words.get("robot", "")
            if lan or (robot and not (email or code) and session.is_paired(robot)):
                sign_in: session.SignIn | session.PairedSignIn = session.PairedSignIn(robot)
            elif robot and not (email or code):
                session.refuse_unpaired(robot, _words_for(context, robot))
            else:
                sign_in = session.SignIn.asked(server, email, code, password_stdin=password_stdin)
            decides = sys.stdin.isatty() if is_person is None else is_person
            raise typer.Exit(
                session.run(sign_in, work, is_person=decides, shows_timeline=timeline, interrupted=interrupted)
            )

        own = list(inspect.signature(work_of, eval_str=True).parameters.values())
        context, *account, by_pairing, timeline, _ = inspect.signature(signed_in, eval_str=True).parameters.values()
        arguments = sum(map(_is_argument, own))
        account += [by_pairing] if "robot" in inspect.signature(work_of).parameters else []
        options = [context, *own[:arguments], *account, *own[arguments:], *([timeline] if has_timeline else [])]
        _take(signed_in, options)
        signed_in.__doc__ = work_of.__doc__
        return group.command(work_of.__name__.replace("_", "-"))(signed_in)

    return made


def _words_for(context: typer.Context, robot: str) -> Callable[[str], str]:
    """Writes the command line that was typed with another robot, one that this machine is paired with."""
    commands = context.command_path.split()
    given = list(context.obj or ())[len(commands) - 1 :]
    at = given.index(robot) if robot in given else 0

    def words(paired: str) -> str:
        return shlex.join([*commands, *given[:at], paired, *given[at + 1 :], "--lan"])

    return words


def _is_argument(parameter: inspect.Parameter) -> bool:
    return any(isinstance(one, ArgumentInfo) for one in getattr(parameter.annotation, "__metadata__", ()))


def _take(function: Callable[..., NoReturn], options: list[inspect.Parameter]) -> None:
    """Typer reads from these two what a function takes."""
    by_name = [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in options]
    function.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    function.__annotations__ = {option.name: option.annotation for option in options}
