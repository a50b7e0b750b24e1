"""Models the programs that a robot's file allows, and the arguments that an operator may give them."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Field, StringConstraints, TypeAdapter, create_model, model_validator
from pydantic_core import SchemaError

from mosaic_core.contract.params import Message, Params, unit

MAX_ARGUMENTS = 16
MAX_TEXT = 256
SHELLS = frozenset({"sh", "bash", "dash", "ash", "zsh", "ksh", "mksh", "csh", "tcsh", "fish", "busybox", "pwsh"})
NAME = r"[a-z][a-z0-9_]{0,31}"
_PLACE = re.compile(r"\{(" + NAME + r")\}")
Word = Annotated[str, StringConstraints(max_length=4096, pattern=r"^[^\x00]*$")]
CommandName = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_-]{0,63}$")]
ArgumentName = Annotated[str, StringConstraints(pattern=f"^{NAME}$")]
VariableName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,63}$")]


def _is_no_option(text: str) -> str:
    """Raises :class:`ValueError` for text that a program may take for an option, or that has control characters."""
    if text.startswith("-"):
        raise ValueError("begins with -, as an option does")
    if not text.isprintable():
        raise ValueError("has characters that can't be printed")
    return text


def _check_pattern(pattern: str) -> None:
    """Raises :class:`ValueError` for what is no pattern by itself: `a)|(b` would be one only between our brackets, and
    then match parts."""
    try:
        TypeAdapter(Annotated[str, StringConstraints(pattern=pattern)])
    except SchemaError as error:
        raise ValueError(f"pattern: no regular expression: {str(error).splitlines()[-1]}") from None


class CommandArgument(Params):
    """What an operator may write in one place: exactly one of `pattern`, `choices`, or `min` with `max`."""

    pattern: str | None = Field(
        default=None, max_length=MAX_TEXT, description="A regular expression that all of the text must match."
    )
    choices: tuple[Annotated[str, StringConstraints(max_length=MAX_TEXT, pattern=r"^[^\x00]*$")], ...] | None = Field(
        default=None, min_length=1, max_length=256, description="The texts that are allowed."
    )
    min: float | None = Field(default=None, description="The least number.", json_schema_extra=unit(""))
    max: float | None = Field(default=None, description="The greatest number.", json_schema_extra=unit(""))
    type: Literal["number", "integer"] = Field(default="number", description="Of what is between `min` and `max`.")
    max_length: int = Field(default=64, ge=1, le=MAX_TEXT, description="Of what `pattern` allows, in characters.")
    description: str = Field(default="", max_length=200, description="What it means.")

    @model_validator(mode="after")
    def _says_one_thing(self) -> CommandArgument:
        is_number = self.min is not None and self.max is not None
        if (self.min is None) != (self.max is None) or sum((bool(self.pattern), bool(self.choices), is_number)) != 1:
            raise ValueError("say what is allowed: one of pattern, choices, or min with max")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError("min is greater than max")
        if self.pattern is not None:
            _check_pattern(self.pattern)
        return self

    @property
    def annotation(self) -> Any:
        """Its type in the model of the command. Patterns run in linear time: the engine is Rust's."""
        if self.choices is not None:
            return Literal.__getitem__(self.choices)
        if self.pattern is not None:
            whole = StringConstraints(max_length=self.max_length, pattern=f"^(?:{self.pattern})$", strict=True)
            return Annotated[str, whole, AfterValidator(_is_no_option)]
        kind = int if self.type == "integer" else float
        return Annotated[kind, Field(ge=self.min, le=self.max, strict=self.type == "integer")]


class AllowedCommand(Params):
    """One program, and where an operator's arguments stand among its own."""

    argv: tuple[Word, ...] = Field(
        min_length=1,
        max_length=64,
        description="The program by its whole path, and its arguments; {name} stands for an operator's.",
    )
    arguments: dict[ArgumentName, CommandArgument] = Field(
        default={}, max_length=MAX_ARGUMENTS, description="What an operator says; all of them must be said."
    )
    timeout_s: float = Field(default=10.0, gt=0, le=3600, description="Seconds after which it is ended.")
    description: str = Field(default="", max_length=200, description="What it does.")

    @model_validator(mode="after")
    def _is_a_program_and_no_shell(self) -> AllowedCommand:
        program = self.argv[0]
        if not PurePosixPath(program).is_absolute() or _PLACE.search(program):
            raise ValueError(f"{program!r}: write the program's whole path, such as /usr/bin/systemctl")
        shell = next((word for word in self.argv if PurePosixPath(word).name in SHELLS), None)
        if shell is not None:
            raise ValueError(f"{shell!r} is a shell, which would read more into arguments; name the program itself")
        places = {name for word in self.argv for name in _PLACE.findall(word)}
        if places != set(self.arguments):
            odd = ", ".join(sorted(places ^ set(self.arguments)))
            raise ValueError(f"{odd}: must stand both in argv, as {{name}}, and among the arguments")
        return self

    def model(self, name: str) -> type[Message]:
        """The model of its arguments; one that it does not know is refused."""
        fields: dict[str, Any] = {
            key: (one.annotation, Field(description=one.description or None)) for key, one in self.arguments.items()
        }
        return create_model(name, __base__=_Arguments, __module__=__name__, **fields)

    def filled(self, arguments: Message) -> list[str]:
        """The words to run it with: each stays one word, whatever is in it."""
        said = {name: _word(getattr(arguments, name)) for name in self.arguments}
        return [_PLACE.sub(lambda place: said[place[1]], word) for word in self.argv]


class _Arguments(Message):
    model_config = ConfigDict(extra="forbid")


def _word(value: object) -> str:
    return f"{value:.15g}" if isinstance(value, float) else str(value)


class ShellCommandParams(Params):
    commands: dict[CommandName, AllowedCommand] = Field(
        min_length=1, max_length=64, description="The programs that operators may run, by name."
    )
    needs: Literal["lease", "supervisor", "operator"] = Field(
        default="lease",
        description="Who may: the holder of the lease, whose stop also ends it; a supervisor; or any operator.",
    )
    folder: str = Field(default="/", pattern=r"^/[^\x00]*$", description="Where they run.")
    environment: dict[VariableName, Word] = Field(
        default={}, max_length=32, description="Theirs beside PATH and LANG; nothing of the robot's own gets there."
    )
    max_output_bytes: int = Field(default=8192, ge=256, le=16_384, description="Of the output the end is kept.")
    at_once: int = Field(default=1, ge=1, le=8, description="So many run at the same time; others wait.")
