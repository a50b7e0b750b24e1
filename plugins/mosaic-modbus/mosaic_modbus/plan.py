"""Plans requests: what lies side by side is read, and written, in one. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mosaic_modbus.numbers import width
from mosaic_modbus.params import ReadKind, RegisterField

MAX_READ = {"holding": 125, "input": 125, "coil": 2000, "discrete": 2000}
MAX_WRITE = {"holding": 123, "coil": 1968}
"""Of one request: sections 6.1 to 6.12 of the Modbus Application Protocol, V1.1b3."""


@dataclass(frozen=True, slots=True)
class Block:
    """What one request reads: ``count`` from ``address`` on, and the names of the fields in it."""

    kind: ReadKind
    address: int
    count: int
    names: tuple[str, ...]

    def words_of(self, field: RegisterField, words: Sequence[int]) -> Sequence[int]:
        """The part of ``words`` that ``field`` lies in."""
        at = field.address - self.address
        return words[at : at + width(field)]

    def __str__(self) -> str:
        last = self.address + self.count - 1
        return f"{self.kind} {self.address}" if self.count == 1 else f"{self.kind} {self.address} to {last}"


def read_plan(fields: Mapping[str, RegisterField], max_gap: int = 0) -> list[Block]:
    """As few blocks as can be. ``max_gap``: so many that nobody asked for may lie between two fields."""
    found: list[Block] = []
    for name, field in sorted(fields.items(), key=lambda one: (one[1].kind, one[1].address, width(one[1]))):
        last, end = (found[-1] if found else None), field.address + width(field)
        if last is not None and _joins(last, field, end, max_gap):
            count = max(last.count, end - last.address)
            found[-1] = Block(last.kind, last.address, count, (*last.names, name))
        else:
            found.append(Block(field.kind, field.address, width(field), (name,)))
    return found


def _joins(last: Block, field: RegisterField, end: int, max_gap: int) -> bool:
    is_near = field.address <= last.address + last.count + max_gap
    return field.kind == last.kind and is_near and end - last.address <= MAX_READ[field.kind]


@dataclass(frozen=True, slots=True)
class Write:
    """What one request writes."""

    kind: ReadKind
    address: int
    words: tuple[int, ...]

    def __str__(self) -> str:
        return str(Block(self.kind, self.address, len(self.words), ()))


def writes_of(fields: Mapping[str, RegisterField], words: Mapping[str, Sequence[int]]) -> Iterator[Write]:
    """As few writes as can be, by address. Only what touches is written together: nothing else is overwritten."""
    pending: Write | None = None
    for name in sorted(words, key=lambda one: (fields[one].kind, fields[one].address)):
        field = fields[name]
        if pending is not None and _touches(pending, field, len(words[name])):
            pending = Write(pending.kind, pending.address, (*pending.words, *words[name]))
            continue
        if pending is not None:
            yield pending
        pending = Write(field.kind, field.address, tuple(words[name]))
    if pending is not None:
        yield pending


def _touches(pending: Write, field: RegisterField, count: int) -> bool:
    is_next = (field.kind, field.address) == (pending.kind, pending.address + len(pending.words))
    return is_next and len(pending.words) + count <= MAX_WRITE[pending.kind]


def overlap(fields: Mapping[str, RegisterField]) -> tuple[str, str] | None:
    """Two fields that would be written into the same register, if there are any."""
    last: tuple[str, RegisterField] | None = None
    for name, field in sorted(fields.items(), key=lambda one: (one[1].kind, one[1].address)):
        if last is not None and last[1].kind == field.kind and field.address < last[1].address + width(last[1]):
            return last[0], name
        if (
            last is None
            or last[1].kind != field.kind
            or field.address + width(field) > last[1].address + width(last[1])
        ):
            last = name, field
    return None
