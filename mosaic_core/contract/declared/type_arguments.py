"""Reads the types that a class gives its bases in brackets, and refuses one that says too few, too many or none.

``typing`` refuses a wrong number by itself, before there is a class that could be named.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar, cast, get_args, get_origin

from mosaic_core.contract.declared.wrong_declaration import wrong_declaration


class TypeArguments:
    """The mixin of bases that take types in brackets; each names them in its ``__class_getitem__`` or has none."""

    def __class_getitem__(cls, arguments: Any) -> Any:
        given = arguments if isinstance(arguments, tuple) else (arguments,)
        if len(given) != len(_taken_by(cls)):
            return _Miscounted(cls, given)
        return cast(Any, super()).__class_getitem__(arguments)

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Raises :class:`MosaicError` for a wrong number of them."""
        super().__init_subclass__(**kwargs)
        for wrong in _bases_of(cls):
            if isinstance(wrong, _Miscounted):
                raise wrong_declaration(cls, *wrong.told())


class _Miscounted:
    """A base with a wrong number of types: it lets the class statement go on as far as the class has a name."""

    def __init__(self, base: type, given: tuple[Any, ...]) -> None:
        self._base = base
        self._given = given

    def __mro_entries__(self, bases: tuple[Any, ...]) -> tuple[type, ...]:
        return (self._base,)

    def told(self) -> tuple[str, str]:
        """What is wrong, and the cure."""
        taken, name = [_MEANINGS.get(one, one) for one in _taken_by(self._base)], self._base.__name__
        count = "1 type" if len(self._given) == 1 else f"{len(self._given)} types"
        if not taken:
            return f"it gives {name} {count}, which takes none.", f"Write `{name}` without brackets."
        return f"it gives {name} {count} instead of {len(taken)}.", f"Write `{name}[{', '.join(taken)}]`."


_MEANINGS = {"P": "YourParams", "T": "YourMessage", "Q": "YourQuestion", "A": "YourAnswer"}
"""What stands in the brackets, by the names that the contract's own bases give them."""


def bare_bases(cls: type) -> Iterator[type]:
    """The bases that take types and got none."""
    return (base for base in _bases_of(cls) if isinstance(base, type) and _taken_by(base))


def argument_of(cls: type, base: type, index: int) -> Any:
    """What ``cls``, or the nearest class that it derives from, has at this place in the brackets of ``base`` or of a
    class derived from that; ``None`` where nothing is said there."""
    for one in cls.__mro__:
        for generic in vars(one).get("__orig_bases__", ()):
            origin, arguments = get_origin(generic), get_args(generic)
            is_its = isinstance(origin, type) and issubclass(origin, base)
            if is_its and len(arguments) > index and not isinstance(arguments[index], TypeVar):
                return arguments[index]
    return None


def _bases_of(cls: type) -> tuple[Any, ...]:
    """As the class statement has them."""
    return cast("tuple[Any, ...]", vars(cls).get("__orig_bases__", cls.__bases__))


def _taken_by(base: type) -> tuple[str, ...]:
    return tuple(one.__name__ for one in getattr(base, "__parameters__", ()))
