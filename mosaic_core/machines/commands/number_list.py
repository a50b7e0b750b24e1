"""Reads and writes the numbers that stand in a list of a message as fields of their own: ``positions.shoulder`` where
another list names them, else by their index, ``positions.0``. ``positions.*`` stands for all of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mosaic_core.machines.commands.message_numbers import OutOfRange, finite_number, put, value_at
from mosaic_core.words.errors import hint_at, nearest

EVERY = "*"
"""The key that stands for all numbers of a list."""
MAX_NUMBERS = 1024
"""As many numbers of lists are remembered for one receiver: four times the joints that a message may name."""


@dataclass(frozen=True, slots=True)
class NumberList:
    """A list of numbers at ``path``, a dotted one. ``names``: the path of the list that says what each is of; empty:
    they are told apart by their index. ``known``: all the names that there are; empty: nobody knows."""

    path: str
    names: str = ""
    known: frozenset[str] = frozenset()

    @property
    def every(self) -> str:
        """The field that stands for all of them."""
        return f"{self.path}.{EVERY}"

    def holds(self, field: str) -> bool:
        """Whether ``field`` is one of its numbers, or all of them."""
        return field.startswith(f"{self.path}.")

    def key_of(self, field: str) -> str:
        """``shoulder`` of ``positions.shoulder``."""
        return field[len(self.path) + 1 :]

    def could_hold(self, field: str) -> bool:
        """Whether a message may have this field, as far as anybody knows."""
        key = self.key_of(field) if self.holds(field) else ""
        if not self.names:
            return key == EVERY or key.isdecimal()
        return key != "" and (key == EVERY or not self.known or key in self.known)

    def read(self, message: Mapping[str, Any]) -> dict[str, float]:
        """The numbers of ``message`` by field; none where it has no such list. Raises :class:`OutOfRange` for what is
        no finite number, and for names that do not fit."""
        try:
            values = value_at(message, tuple(self.path.split(".")), self.path)
        except KeyError:
            return {}
        if not isinstance(values, list):
            raise OutOfRange(f"{self.path} is no list but a {type(values).__name__}")
        if len(values) > MAX_NUMBERS:
            raise OutOfRange(f"{self.path} has {len(values)} numbers, and {MAX_NUMBERS} are the most")
        fields = [f"{self.path}.{key}" for key in self._keys(message, len(values))]
        return {field: finite_number(value, field) for field, value in zip(fields, values, strict=True)}

    def write(self, shaped: dict[str, Any], message: Mapping[str, Any], values: Iterable[float | None]) -> None:
        """Put ``values``, one for each of its numbers in their order, into ``shaped``, a copy of ``message``; ``None``
        leaves a number as it is, also an integer."""
        path = tuple(self.path.split("."))
        said = value_at(message, path, self.path)
        put(shaped, message, path, [old if new is None else new for old, new in zip(said, values, strict=True)])

    def _keys(self, message: Mapping[str, Any], count: int) -> Collection[str]:
        if not self.names:
            return [str(index) for index in range(count)]
        try:
            names = value_at(message, tuple(self.names.split(".")), self.names)
        except KeyError:
            raise self._unnamed(message) from None
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise OutOfRange(f"{self.names} is no list of texts")
        if len(names) != count:
            values = "1 value" if count == 1 else f"{count} values"
            raise OutOfRange(f"{self.path} has {values} for {len(names)} {self.names}")
        if len(set(names)) != len(names):
            raise OutOfRange(f"{self.names} has a name twice")
        unknown = next((name for name in names if self.known and name not in self.known), None)
        if unknown is not None:
            known = ", ".join(sorted(self.known))
            raise OutOfRange(f"{self.names}: there is no {unknown!r}{hint_at(unknown, self.known)} There are: {known}")
        return names

    def _unnamed(self, message: Mapping[str, Any]) -> OutOfRange:
        """Of a message without the list that names its numbers: what was probably meant to be it."""
        *way, key = self.names.split(".")
        around = value_at(message, tuple(way), self.names) if way else message
        meant = nearest(key, around)
        written = f": it has '{meant}' instead" if meant else ""
        return OutOfRange(f"{self.names!r}, which names {self.path}, is missing{written}")
