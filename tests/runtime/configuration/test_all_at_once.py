"""A mistake in one key of ``safety:`` hides none in the others."""

from __future__ import annotations

from pathlib import Path

from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.config_loader import validate_file

FILE = """\
connectors:
  - type: cmd-vel
    label: cmd_vel
    params: { drive: { type: log } }
    safety:
      timeout_s: -1
      limits:
        linear.x: { max: fast }
        linear.q: { max: 1 }
        angular.z: { min: 1 }
"""


def test_mistakes_that_only_the_connector_knows_are_told_beside_those_of_the_form(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(FILE)
    validation = validate_file(tmp_path / "robot.yaml")
    found = [*validation.problems, *AutoConfigurer().rehearse(validation).problems]
    assert validation.checked is None
    assert sorted(one.path.removeprefix("connectors[0].safety.") for one in found) == [
        "limits.angular.z.min", "limits.linear.q", "limits.linear.x.max", "timeout_s",
    ]  # fmt: skip
    assert {one.line for one in found} == {6, 8, 9, 10}
