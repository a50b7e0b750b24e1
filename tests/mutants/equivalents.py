"""The list of changes that no test can notice, each with its reason; an entry that excuses nothing any more is told."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from mutation import Mutant, Name


@dataclass(slots=True)
class Equivalents:
    reasons: dict[Name, str]
    used: Counter[Name] = field(default_factory=Counter)

    @classmethod
    def read(cls, path: Path) -> Equivalents:
        """Raises ``SystemExit`` where an entry gives no reason or stands there twice."""
        reasons: dict[Name, str] = {}
        for entry in tomllib.loads(path.read_text()).get("equivalent", []):
            name = (entry["module"], entry.get("function", ""), entry["original"], entry["mutated"])
            if name in reasons or not entry.get("reason", "").strip():
                raise SystemExit(f"{path.name}: {' · '.join(name)} wants one entry with a reason")
            reasons[name] = entry["reason"]
        return cls(reasons)

    def excuses(self, mutant: Mutant) -> bool:
        self.used[mutant.name] += 1
        return mutant.name in self.reasons

    def stale(self, modules: Iterable[str]) -> list[str]:
        """Entries of ``modules``, all of whose mutants were tried, that excused none: the code has changed, or a test
        notices now."""
        tried = set(modules)
        return [
            f"equivalent.toml: {' · '.join(name)} lives no more, or is there no more: remove the entry"
            for name in self.reasons
            if name[0] in tried and not self.used[name]
        ]
