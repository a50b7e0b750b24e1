"""The newer address of original dashboards for a robot's token."""

from __future__ import annotations

from fastapi import APIRouter

from mosaic_server.rest.envelope import Envelope
from mosaic_server.rest.robots import RobotToken, renewed_token
from mosaic_server.rest.signed_in import AdminDep, ServicesDep

router = APIRouter(prefix="/api/v1/robot-auth", tags=["robots"])


@router.post("/simple-token/{robot_id}")
async def create_token(robot_id: str, admin: AdminDep, services: ServicesDep) -> Envelope[RobotToken]:
    """A new token, as ``POST /api/v1/robots/auth/simple-token`` makes it."""
    return await renewed_token(robot_id, admin, services)
