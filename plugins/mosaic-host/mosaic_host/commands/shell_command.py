"""The ``shell-command`` connector: programs that the robot's file allows, run at an operator's request.

There is no shell: words of the file, with an operator's arguments in their places, become the words of one program.
"""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Literal, TypeVar

from pydantic import Field, ValidationError, create_model

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import Refused
from mosaic_core.contract.params import Message, unit
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.words.wire_model import told_mistakes
from mosaic_host.commands.output import KeptOutput
from mosaic_host.commands.params import AllowedCommand, ShellCommandParams
from mosaic_host.running_program import GRACE_S, LOOK_S, RunningProgram

LEFT_OPEN_S = 0.5
"""A program that has ended may have left its output open to others, who say no more that is waited for."""
PROGRESS_BYTES = 2048
PROGRESS_PERIOD_S = 0.2
"""The framework passes on five a second."""
Q = TypeVar("Q")


class CommandRun(Message):
    """What an operator asks for."""

    command: str
    arguments: dict[str, str | int | float] = Field(default={}, max_length=16)


class CommandProgress(Message):
    """What it has said so far."""

    output: str = Field(description="The end of it.")
    output_bytes: int = Field(json_schema_extra=unit("B"), description="All of it.")


class CommandResult(Message):
    """How it ended."""

    exit_code: int = Field(description="0: it is content; negative: the signal that ended it.")
    output: str = Field(description="What it said, on either pipe; where that was too much, the end of it.")
    output_bytes: int = Field(json_schema_extra=unit("B"), description="All of what it said.")
    is_cut: bool = Field(description="Whether the beginning of the output is missing.")
    duration_s: float = Field(json_schema_extra=unit("s"))


@dataclass(frozen=True, slots=True)
class Runnable:
    """One program that may be run, and the model of its arguments."""

    command: AllowedCommand
    model: type[Message]

    def words(self, arguments: Mapping[str, Any]) -> list[str]:
        """Raises :class:`Refused` (``channel.invalid``)."""
        try:
            return self.command.filled(self.model.model_validate(arguments))
        except ValidationError as error:
            raise Refused("channel.invalid", told_mistakes(error)[:512]) from None


class ShellCommand(RequestHandler[Q, CommandResult], Generic[Q]):
    """Runs one program for each request, on the request's own thread."""

    def __init__(self, label: str, params: ShellCommandParams) -> None:
        super().__init__(label)
        self.requires_lease = params.needs == "lease"
        self._params = params
        self._known = {name: Runnable(one, one.model("CommandArguments")) for name, one in params.commands.items()}

    def answer(self, question: Q, request: Request) -> Any:
        """Raises :class:`Refused`."""
        assert isinstance(question, CommandRun)
        if self._params.needs == "supervisor" and request.sender.role != "supervisor":
            raise Refused("lease.forbidden", "only a supervisor may run this")
        runnable = self._known[question.command]
        words = runnable.words(question.arguments)
        child = RunningProgram(words, self._params.environment, self._params.folder)
        begun_s = self.monotonic_s()
        try:
            kept = self._run(child, request, runnable.command.timeout_s)
        except OSError as error:
            raise Refused("plugin.no_device", f"{words[0]}: {error.strerror}") from error
        return CommandResult(
            exit_code=child.exit_code or 0,
            output=kept.text(),
            output_bytes=kept.total_bytes,
            is_cut=kept.is_cut,
            duration_s=round(self.monotonic_s() - begun_s, 3),
        )

    def _run(self, child: RunningProgram, request: Request, timeout_s: float) -> KeptOutput:
        kept = KeptOutput(self._params.max_output_bytes)
        watch = _Watch(self, request, timeout_s)
        with child:
            while not request.is_cancelled:
                said = child.look(LOOK_S)
                kept.add(said.out)
                kept.add(said.error)
                if said.is_over or watch.is_done(child.has_ended):
                    if said.is_over:
                        watch.wait_for(child)
                    break
                watch.tell(kept)
        return kept


class _Watch:
    """Knows how long one program may run, and tells how far it is."""

    def __init__(self, handler: ShellCommand[Any], request: Request, timeout_s: float) -> None:
        self._now_s = handler.monotonic_s
        self._request = request
        self._timeout_s = timeout_s
        self._ends_at_s = self._now_s() + timeout_s
        self._told_at_s = self._now_s()
        self._told_bytes = 0
        self._ended_at_s: float | None = None

    def is_done(self, has_ended: bool) -> bool:
        """Whether nothing more is waited for. Raises :class:`Refused` (``request.timeout``)."""
        now_s = self._now_s()
        if has_ended and self._ended_at_s is None:
            self._ended_at_s = now_s
        if self._ended_at_s is not None:
            return now_s - self._ended_at_s >= LEFT_OPEN_S
        if now_s >= self._ends_at_s:
            raise Refused("request.timeout", f"ended after {self._timeout_s:g} s")
        return False

    def wait_for(self, child: RunningProgram) -> None:
        """It has closed its output: wait until it has ended. Raises :class:`Refused` (``request.timeout``)."""
        while not child.has_ended and not self._request.is_cancelled and not self.is_done(False):
            child.look(0.01)

    def tell(self, kept: KeptOutput) -> None:
        now_s = self._now_s()
        if kept.total_bytes > self._told_bytes and now_s - self._told_at_s >= PROGRESS_PERIOD_S:
            self._told_at_s, self._told_bytes = now_s, kept.total_bytes
            self._request.progress(CommandProgress(output=kept.text(PROGRESS_BYTES), output_bytes=kept.total_bytes))


class ShellCommandConfigurer(DataChannelConfigurer[ShellCommandParams]):
    """Programs that the robot's file allows, run at an operator's request."""

    connector_type = "shell-command"
    example: ClassVar[dict[str, Any] | None] = {
        "commands": {
            "restart": {
                "argv": ["/usr/bin/systemctl", "restart", "{unit}"],
                "arguments": {"unit": {"choices": ["lidar.service", "base.service"]}},
            }
        }
    }
    trial: ClassVar[dict[str, Any] | None] = {
        "commands": {"echo": {"argv": ["/bin/echo", "{text}"], "arguments": {"text": {"pattern": "[a-z ]+"}}}}
    }

    def configure(self) -> ShellCommand[Any]:
        params = self.params
        names: Any = Literal.__getitem__(tuple(params.commands))
        question = create_model("CommandRun", __base__=CommandRun, __module__=__name__, command=(names, Field()))
        within_s = max(one.timeout_s for one in params.commands.values()) + GRACE_S + 1
        content = {"__module__": __name__, "answer_within_s": within_s, "at_once": params.at_once}
        base: Any = ShellCommand
        made = types.new_class("ShellCommand", (base[question],), {}, lambda own: own.update(content))
        return made(self.label, params)  # type: ignore[no-any-return]
