"""Asks for known holes in everything that is locked: Python's packages by pip-audit, the dashboard's by npm.

``python -m release.audit [--must-answer]``. Exits 1 where there is a hole, and with ``--must-answer`` also where nobody
answered. Silence is never taken for innocence: what was not checked is said to be.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from release.requirements import LOCKS, ROOT, SETS

PATIENCE_S = 300


@dataclass
class Answer:
    """What is known about one set of packages: holes, and what could not be checked and why."""

    what: str
    checked: int = 0
    holes: list[str] = field(default_factory=list)
    unchecked: list[str] = field(default_factory=list)
    silence: str = ""

    @property
    def is_complete(self) -> bool:
        return not self.silence and not self.unchecked

    def __str__(self) -> str:
        lines = [f"  {hole}" for hole in self.holes]
        if self.silence:
            lines.append(f"  not checked: no answer ({self.silence})")
        if self.unchecked:
            lines.append(
                f"  not checked: no answer about {len(self.unchecked)} packages ({_shortened(self.unchecked)})"
            )
        if self.checked and not self.holes:
            lines.append(f"  no known hole in {self.checked} packages")
        return "\n".join([f"{self.what}:", *lines])


def of_python(lock: str, said: str, error: str) -> Answer:
    """From pip-audit's JSON; a package that its service doesn't know has been looked at by nobody."""
    answer = Answer(f"locks/{lock}.txt")
    try:
        dependencies = json.loads(said)["dependencies"]
    except (ValueError, KeyError):
        answer.silence = _last_line(error)
        return answer
    for one in dependencies:
        if "skip_reason" in one:
            answer.unchecked.append(one["name"])
            continue
        answer.checked += 1
        for hole in one["vulns"]:
            fixed = ", ".join(hole["fix_versions"]) or "no version yet"
            answer.holes.append(f"{one['name']} {one['version']}: {hole['id']}, mended in {fixed}")
    return answer


def of_dashboard(said: str, error: str) -> Answer:
    """From npm's JSON, which has no count of packages where its registry refuses to say."""
    answer = Answer("dashboard/package-lock.json")
    try:
        report: dict[str, Any] = json.loads(said)
        answer.checked = report["metadata"]["dependencies"]["total"]
    except (ValueError, KeyError):
        answer.silence = _last_line(error)
        return answer
    for name, hole in report["vulnerabilities"].items():
        answer.holes.append(f"{name} {hole['range']}: {hole['severity']}; `npm audit` in dashboard/ says more")
    return answer


def main(words: Sequence[str]) -> int:
    audit = [sys.executable, "-m", "pip_audit", "--disable-pip", "--require-hashes", "--format", "json"]
    audit += ["--progress-spinner", "off", "--requirement"]
    answers = [of_python(lock, *_asked([*audit, str(LOCKS / f"{lock}.txt")], ROOT)) for lock in SETS]
    answers.append(of_dashboard(*_asked(["npm", "audit", "--json"], ROOT / "dashboard")))
    print(*answers, sep="\n")
    holes, is_complete = any(answer.holes for answer in answers), all(answer.is_complete for answer in answers)
    if not is_complete:
        print("Not everything was checked: run it again where the package registries' advisories can be reached.")
    return int(holes or (not is_complete and "--must-answer" in words))


def _asked(words: list[str], folder: Path) -> tuple[str, str]:
    """Both tools exit 1 for a hole and for a failure alike: what they print decides."""
    try:
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return "", f"nothing within {PATIENCE_S} s"
    return done.stdout, done.stderr


def _shortened(names: list[str]) -> str:
    return ", ".join(names[:3]) + (" …" if len(names) > 3 else "")


def _last_line(error: str) -> str:
    lines = [line.strip() for line in error.splitlines() if line.strip() and "complete log" not in line]
    return lines[-1] if lines else "it said nothing"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
