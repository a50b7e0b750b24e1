"""mosaic-depth stands on the highest rung of the quality ladder."""

from mosaic_core.testing import missing_to_gold


async def test_nothing_is_missing_to_gold() -> None:
    assert await missing_to_gold("mosaic-depth") == []
