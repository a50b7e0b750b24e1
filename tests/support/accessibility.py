"""Examines pages in Chromium with axe-core, the way a person with a screen reader or weak eyes would meet them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from playwright.sync_api import Page

AXE = Path(__file__).parents[2] / "dashboard" / "node_modules" / "axe-core" / "axe.min.js"
DESKTOP = {"width": 1280, "height": 900}
PHONE = {"width": 390, "height": 844}
LANDSCAPE = {"width": 667, "height": 375}
LOOKS: tuple[tuple[Any, Any], ...] = (("dark", PHONE), ("dark", DESKTOP), ("light", LANDSCAPE), ("light", DESKTOP))
"""Both colour schemes on a screen, and each small size in one of them. The last is how tests have it otherwise."""
GENERATED = re.compile(r"mantine-[a-z0-9]{9}")
"""Ids that are others in every run."""
BAD = ("critical", "serious")
EXAMINE = """async (within) => {
  for (const animation of document.getAnimations()) {
    if (Number.isFinite(animation.effect.getComputedTiming().endTime)) animation.finish()
  }
  // It takes no pointer and shows what is below, which axe does not see: nothing under it would be judged.
  const frame = document.querySelector('[data-testid=control-frame]')
  if (frame !== null) frame.style.display = 'none'
  const { violations } = await axe.run(within, { resultTypes: ['violations'], preload: false })
  if (frame !== null) frame.style.display = ''
  const problems = ({ id, impact, nodes }) =>
    nodes.map(({ target, any, all, none }) => {
      const [first] = [...any, ...all, ...none]
      return [impact, `${id}: ${target.join(' ')}: ${first?.message ?? ''}`]
    })
  return violations.flatMap(problems)
}"""


@dataclass
class Examination:
    """Looks at one state of a page after the other, and keeps what is critical or serious, each once."""

    page: Page
    problems: dict[str, str] = field(default_factory=dict)
    """Where each was met first."""

    def look(self, state: str, within: str = "html") -> None:
        """At this part of the page as it is now, in both colour schemes and in three sizes."""
        for scheme, size in LOOKS:
            self.page.set_viewport_size(size)
            self.page.emulate_media(color_scheme=scheme)
            self.page.locator(f"[data-mantine-color-scheme={scheme}]").wait_for(state="attached")
            if not self.page.evaluate("() => 'axe' in window"):
                self.page.evaluate(AXE.read_text())
            for impact, what in self.page.evaluate(EXAMINE, within):
                if impact in BAD:
                    self.problems.setdefault(GENERATED.sub("*", what), f"{state}, {scheme}")

    def expect_nothing(self) -> None:
        assert not self.problems, "\n".join(f"{where}: {what}" for what, where in self.problems.items())
