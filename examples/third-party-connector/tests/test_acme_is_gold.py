"""The distribution stands on the highest rung of the quality ladder: what `mosaic plugin check . --level gold` says."""

from pathlib import Path

from mosaic_core.testing import missing_to_gold


async def test_nothing_is_missing_to_gold() -> None:
    assert await missing_to_gold(str(Path(__file__).parents[1])) == []
