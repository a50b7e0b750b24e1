"""The two models a plugin author writes: the ``params`` of a connector, and its messages."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError, ValidationInfo, model_validator
from pydantic_core import CoreSchema, core_schema

from mosaic_core.contract.declared.default_values import check_defaults
from mosaic_core.contract.declared.message_words import check_message_words
from mosaic_core.contract.declared.nested_models import check_nested
from mosaic_core.contract.declared.unsent import may_be_none, unknown_field, with_its_nans
from mosaic_core.words.limits import MotionKind


class Params(BaseModel):
    """Base of a connector's ``params``: unknown keys are errors, numbers written as strings are read as numbers.

    Give fields units in their names (``period_s``), defaults, and ``Field(description=…)``: the command line, the
    YAML schema and the documentation are made from them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Raises :class:`MosaicError` for a field in which a misspelt key would be ignored, and for a wrong default."""
        super().__pydantic_init_subclass__(**kwargs)
        check_nested(cls)
        check_defaults(cls)


class _NamingText(str):
    """Text in ``params`` that names something of the robot, and keeps its class when it is read."""

    __slots__ = ()

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        text = core_schema.no_info_before_validator_function(_as_text, core_schema.str_schema())
        return core_schema.no_info_after_validator_function(cls, text)


class CameraLabel(_NamingText):
    """Text in ``params`` that names a camera of the same robot: ``camera: CameraLabel``, ``labels: tuple[CameraLabel,
    ...]``. A label of no camera is a mistake of the file, told with the nearest one before anything starts."""


class DataLabel(_NamingText):
    """Text in ``params`` that names a data channel of the same robot: ``pose: DataLabel``. A label of none is a mistake
    of the file, as of a :class:`CameraLabel`."""


class OwnFolder(_NamingText):
    """Text in ``params`` that names a folder which this connector has to itself: ``directory: OwnFolder``. A second
    connector of the robot with the same folder is a mistake of the file, told before anything starts."""


def _as_text(folder: object) -> object:
    """Whoever makes ``params`` in Python has a :class:`~pathlib.Path`."""
    return os.fspath(folder) if isinstance(folder, os.PathLike) else folder


class Message(BaseModel):
    """Base of a typed message. Its JSON Schema goes into the catalogue; ``Field(json_schema_extra={"unit": "V"})``
    or ``unit("V")`` adds the unit that widgets show. Unknown keys are ignored on receipt, those of a question refused
    (``extra="allow"`` takes them); NaN is refused.

    One that is made of keywords raises :class:`MosaicError` (``plugin.wrong_message``) for a keyword that is no field
    of it. What a device measured may be NaN: of a field that may be absent it is ``None``, and with any other the
    message is made, but refused where it is sent.
    """

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    schema_id: ClassVar[str] = ""
    """The name of its shape, such as ``acme/Grip@1``, for whoever knows it; the number rises when old readers would
    misread it. The catalogue carries it, and a widget may say that it shows it."""
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {}
    """What its numbers move, by dotted path: ``{"linear.x": "velocity"}``; of a list each of its numbers. Velocities
    are the ``motion_fields`` of receivers that take it and name none themselves, positions their
    ``position_fields``."""
    keyed_by: ClassVar[Mapping[str, str]] = {}
    """Which of its lists of numbers another one names: ``{"positions": "names"}``. A number of such a list is the field
    ``positions.<name>``; of any other list it is found by its index, ``positions.0``."""

    def __init__(self, /, **data: Any) -> None:
        if not data.keys() <= type(self).__pydantic_fields__.keys():
            self._refuse_unknown(data)
        try:
            self.__pydantic_validator__.validate_python(data, self_instance=self, context=_MADE_HERE)
        except ValidationError as error:
            raw = self.model_construct(**with_its_nans(type(self), data, error))
            self.__setstate__(raw.__getstate__())

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # what is received is read without it

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Raises :class:`MosaicError` for a wrong default, and for what it says of itself and nobody reads."""
        super().__pydantic_init_subclass__(**kwargs)
        check_message_words(cls)
        check_defaults(cls, _MADE_HERE)

    @classmethod
    def _refuse_unknown(cls, data: Mapping[str, Any]) -> None:
        if cls.model_config.get("extra") == "ignore" and (wrong := unknown_field(cls, data)) is not None:
            raise wrong

    @model_validator(mode="before")
    @classmethod
    def _finite(cls, data: Any, info: ValidationInfo) -> Any:
        """NaN of a field that may be absent is ``None``. Else it is refused, also inside untyped parts, which
        ``allow_inf_nan`` does not reach."""
        if isinstance(data, dict):
            for key, value in data.items():
                if isinstance(value, float) and not math.isfinite(value):
                    if may_be_none(cls.model_fields.get(key)):
                        data = {**data, key: None}
                    elif info.context is not _MADE_HERE:
                        raise ValueError(f"{key} is not a finite number")
        return data


_MADE_HERE = {"is made of": "keywords"}
"""The context of the validation of a message that the robot's own code makes."""


def unit(name: str) -> dict[str, Any]:
    """``Field(json_schema_extra=unit("m/s"))``: the unit of a field, shown by widgets and documentation."""
    return {"unit": name}


class NoParams(Params):
    """The params of connectors that take none."""
