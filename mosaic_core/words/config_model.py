"""The base of every model of the YAML file."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, model_validator


class ConfigModel(BaseModel):
    """Unknown keys are errors; a key without a value (``params:``) counts as absent, as in original robots."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _nothing_is_absent(cls, data: object) -> object:
        return {key: value for key, value in data.items() if value is not None} if isinstance(data, dict) else data
