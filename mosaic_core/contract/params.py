"""The two models a plugin author writes: the ``params`` of a connector, and its messages."""

from __future__ import annotations

import math
from typing import Any

from pydantic import BaseModel, ConfigDict, model_validator


class Params(BaseModel):
    """Base of a connector's ``params``: unknown keys are errors, numbers written as strings are read as numbers.

    Give fields units in their names (``period_s``), defaults, and ``Field(description=…)``: the command line, the
    YAML schema and the documentation are made from them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Message(BaseModel):
    """Base of a typed message. Its JSON Schema goes into the catalogue; ``Field(json_schema_extra={"unit": "V"})``
    or ``unit("V")`` adds the unit that widgets show. Unknown keys are ignored on receipt, NaN is refused."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _finite(cls, data: Any) -> Any:
        """Also refuse NaN inside untyped parts, which ``allow_inf_nan`` does not reach."""
        if isinstance(data, dict):
            for key, value in data.items():
                if isinstance(value, float) and not math.isfinite(value):
                    raise ValueError(f"{key} is not a finite number")
        return data


def unit(name: str) -> dict[str, Any]:
    """``Field(json_schema_extra=unit("m/s"))``: the unit of a field, shown by widgets and documentation."""
    return {"unit": name}


class NoParams(Params):
    """For connectors that take no params."""
