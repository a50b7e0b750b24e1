"""The battery: it only falls, but on the dock."""

from hypothesis import given
from hypothesis import strategies as st

from mosaic_sim.power import LOW_SPEED_MPS, Battery, drained, speed_limit_mps

percents = st.floats(0, 100)
speeds = st.floats(-2, 2)


def after(battery: Battery, *, speed: float = 0.0, turn: float = 0.0, docked: bool = False, dt: float = 1.0) -> Battery:
    return drained(battery, speed_mps=speed, turn_radps=turn, acceleration_mps2=0.0, is_docked=docked, dt_s=dt)


@given(percent=percents, speed=speeds, turn=speeds)
def test_away_from_the_dock_it_never_rises_and_never_leaves_0_to_100(percent: float, speed: float, turn: float) -> None:
    battery = after(Battery(percent), speed=speed, turn=turn)
    assert 0.0 <= battery.percent <= percent
    assert battery.current_a > 0
    assert not battery.is_charging


@given(percent=percents)
def test_on_the_dock_it_never_falls(percent: float) -> None:
    assert after(Battery(percent), docked=True).percent >= percent


def test_motion_costs_more_than_standing() -> None:
    standing, driving = after(Battery(50)), after(Battery(50), speed=1.0)
    assert driving.percent < standing.percent < 50
    assert driving.voltage_v < standing.voltage_v


def test_charging_shows_and_ends_when_full() -> None:
    charging = after(Battery(50), docked=True)
    assert charging.is_charging
    assert charging.current_a < 0
    full = after(Battery(100), docked=True)
    assert not full.is_charging
    assert full.current_a == 0


def test_a_nearly_empty_robot_creeps_and_never_stands() -> None:
    assert speed_limit_mps(Battery(1.0)) == LOW_SPEED_MPS
    assert speed_limit_mps(Battery(50.0)) > 10
