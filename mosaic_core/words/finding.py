"""Models the finding of a check: one sentence for people, a stable code for programs, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from mosaic_core.words.codes import reason
from mosaic_core.words.wire_model import WireModel

__all__ = ["Finding", "failed", "passed", "skipped", "warned"]

Status = Literal["ok", "warn", "fail", "skipped"]

LAST_CURE = "Look into the robot's log for what came before."
"""For codes that name an end and no mistake (``peer.closed``): as a finding they are one."""
OK = "check.ok"
SKIPPED = "check.skipped"


class Finding(WireModel):
    """One result of a check; the same in the terminal, as JSON and in the dashboard."""

    check: str = Field(description="What was looked at: group and name, e.g. `server.tls`. Stable.")
    status: Status
    code: str = Field(description="Key of the table of reason codes.")
    sentence: str
    cure: str = ""
    facts: dict[str, Any] = Field(default_factory=dict, description="Figures and names, by stable keys.")

    @property
    def group(self) -> str:
        """The part of the system that it is about."""
        return self.check.partition(".")[0]


def passed(check: str, sentence: str, **facts: Any) -> Finding:
    """It works."""
    return Finding(check=check, status="ok", code=OK, sentence=sentence, facts=facts)


def skipped(check: str, sentence: str, cure: str = "", **facts: Any) -> Finding:
    """It was not looked at; ``sentence`` says why."""
    return Finding(check=check, status="skipped", code=SKIPPED, sentence=sentence, cure=cure, facts=facts)


def failed(
    check: str, code: str, sentence: str = "", cure: str = "", facts: Mapping[str, Any] | None = None
) -> Finding:
    """It does not work. Sentence and cure default to those of the code, an empty one as well: there is always something
    to do. An unknown code is a :class:`KeyError`."""
    return _problem("fail", check, code, sentence, cure, facts)


def warned(
    check: str, code: str, sentence: str = "", cure: str = "", facts: Mapping[str, Any] | None = None
) -> Finding:
    """It works, but something will be missed; else as :func:`failed`."""
    return _problem("warn", check, code, sentence, cure, facts)


def _problem(
    status: Status, check: str, code: str, sentence: str, cure: str, facts: Mapping[str, Any] | None
) -> Finding:
    known = reason(code)
    return Finding(
        check=check,
        status=status,
        code=code,
        sentence=sentence or known.sentence,
        cure=cure or known.cure or LAST_CURE,
        facts=dict(facts or {}),
    )
