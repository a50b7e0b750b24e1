"""Moves the robot: a differential drive with inertia that collides with the room. Pure; one call is one step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mosaic_sim.room import Floats, Room

STALL_SHARE = 0.25
"""Against a wall, wheels slip and push the robot along it, but stall if less than this share of the speed is left."""


@dataclass(frozen=True, slots=True)
class Chassis:
    """The robot's body: a round base with two driven wheels."""

    radius_m: float = 0.22
    track_width_m: float = 0.36
    max_wheel_mps: float = 1.2
    max_wheel_mps2: float = 2.5
    motor_lag_s: float = 0.06


@dataclass(frozen=True, slots=True)
class Motion:
    """The robot's pose and velocity; yaw is not wrapped, so that it can be differentiated."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0
    left_mps: float = 0.0
    right_mps: float = 0.0
    linear_mps: float = 0.0
    angular_radps: float = 0.0
    linear_mps2: float = 0.0
    travelled_m: float = 0.0
    is_touching: bool = False
    free_m: float = 0.0
    """It can touch nothing before it has moved this far: until then nobody needs to look for walls."""


def wheel_targets(chassis: Chassis, linear_mps: float, angular_radps: float) -> tuple[float, float]:
    """Left and right wheel speeds for a twist; both scaled down alike when one is too fast, so that the curve stays."""
    half = chassis.track_width_m / 2
    left, right = linear_mps - angular_radps * half, linear_mps + angular_radps * half
    excess = max(abs(left), abs(right)) / chassis.max_wheel_mps
    return (left / excess, right / excess) if excess > 1.0 else (left, right)


def moved(room: Room, chassis: Chassis, motion: Motion, command: tuple[float, float], dt_s: float) -> Motion:
    """The motion ``dt_s`` later under ``command`` = (linear m/s, angular rad/s)."""
    targets = wheel_targets(chassis, *command)
    left = _spun_up(chassis, motion.left_mps, targets[0], dt_s)
    right = _spun_up(chassis, motion.right_mps, targets[1], dt_s)
    linear, angular = (left + right) / 2, (right - left) / chassis.track_width_m
    heading = motion.yaw_rad + angular * dt_s / 2
    wish = (linear * dt_s * math.cos(heading), linear * dt_s * math.sin(heading))
    dx, dy, free_m = _unblocked(room, chassis.radius_m, motion, wish)
    is_touching = (dx, dy) != wish
    if is_touching:
        wanted_mps = abs(linear)
        linear = (dx * math.cos(heading) + dy * math.sin(heading)) / dt_s
        if abs(linear) < STALL_SHARE * wanted_mps:
            half = angular * chassis.track_width_m / 2
            left, right = linear - half, linear + half
    return replace(
        motion,
        x_m=motion.x_m + dx,
        y_m=motion.y_m + dy,
        yaw_rad=motion.yaw_rad + angular * dt_s,
        left_mps=left,
        right_mps=right,
        linear_mps=linear,
        angular_radps=angular,
        linear_mps2=(linear - motion.linear_mps) / dt_s,
        travelled_m=motion.travelled_m + math.hypot(dx, dy),
        is_touching=is_touching,
        free_m=free_m,
    )


def _spun_up(chassis: Chassis, speed_mps: float, target_mps: float, dt_s: float) -> float:
    """A motor: first-order lag towards the target, acceleration limited."""
    change = (target_mps - speed_mps) * (1.0 - math.exp(-dt_s / chassis.motor_lag_s))
    limit = chassis.max_wheel_mps2 * dt_s
    speed_mps += min(limit, max(-limit, change))
    # Below a millimetre per second friction wins; without this a stopped robot would creep for ever.
    return 0.0 if target_mps == 0.0 and abs(speed_mps) < 1e-3 else speed_mps


def _unblocked(room: Room, radius_m: float, motion: Motion, wish: tuple[float, float]) -> tuple[float, float, float]:
    """How far of ``wish`` the room lets the robot go (all, along the surface it touches, or nothing), and how far it
    is free from there."""
    length_m = math.hypot(*wish)
    if length_m < motion.free_m or length_m == 0.0:
        return *wish, motion.free_m - length_m
    clearance_m, (nx, ny) = clearance(room, (motion.x_m + wish[0], motion.y_m + wish[1]))
    if clearance_m >= radius_m:
        return *wish, clearance_m - radius_m
    into = wish[0] * nx + wish[1] * ny
    along = (wish[0] - into * nx, wish[1] - into * ny) if into < 0 else wish
    if clearance(room, (motion.x_m + along[0], motion.y_m + along[1]))[0] >= radius_m:
        return *along, 0.0
    return 0.0, 0.0, 0.0


def clearance(room: Room, place: tuple[float, float]) -> tuple[float, tuple[float, float]]:
    """Distance in metres from ``place`` to the nearest surface, and the unit vector that points away from it."""
    p = np.asarray(place)
    away = _away_from_segments(room, p)
    gaps = np.hypot(away[:, 0], away[:, 1])
    from_circles = p - room.circles.centre
    circle_gaps = np.hypot(from_circles[:, 0], from_circles[:, 1])
    gaps = np.concatenate([gaps, circle_gaps - room.circles.radius_m])
    away = np.concatenate([away, from_circles])
    nearest = int(np.argmin(gaps))
    length = math.hypot(away[nearest, 0], away[nearest, 1]) or 1.0
    return float(gaps[nearest]), (float(away[nearest, 0]) / length, float(away[nearest, 1]) / length)


def _away_from_segments(room: Room, p: Floats) -> Floats:
    a, edge = room.segments.a, room.segments.b - room.segments.a
    along = np.clip(np.sum((p - a) * edge, axis=1) / np.sum(edge * edge, axis=1), 0.0, 1.0)
    return np.asarray(p - (a + along[:, None] * edge), dtype=np.float64)
