"""Reads what a compiled model has out of MuJoCo's arrays."""

from __future__ import annotations

from typing import Any

from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.facts import ActuatorFact, ActuatorKind, JointFact, JointKind, ModelFacts, SensorFact, Span

_JOINT_KINDS: tuple[JointKind, ...] = ("free", "ball", "slide", "hinge")
"""By the numbers of ``mjtJoint``."""
_UNITS = {
    "touch": "N", "accelerometer": "m/s²", "velocimeter": "m/s", "gyro": "rad/s", "force": "N", "torque": "Nm",
    "magnetometer": "T", "rangefinder": "m", "camprojection": "px", "tendonpos": "m", "tendonvel": "m/s",
    "actuatorfrc": "N", "tendonactfrc": "N", "ballangvel": "rad/s", "framepos": "m", "framelinvel": "m/s",
    "frameangvel": "rad/s", "framelinacc": "m/s²", "frameangacc": "rad/s²", "subtreecom": "m", "subtreelinvel": "m/s",
    "subtreeangmom": "kg m²/s", "geomdist": "m", "e_potential": "J", "e_kinetic": "J", "clock": "s",
}  # fmt: skip
_OF_A_JOINT = {
    "jointpos": ("rad", "m"), "jointvel": ("rad/s", "m/s"), "jointactuatorfrc": ("Nm", "N"),
    "jointlimitpos": ("rad", "m"), "jointlimitvel": ("rad/s", "m/s"), "jointlimitfrc": ("Nm", "N"),
}  # fmt: skip
"""Of a hinge, and of a slide."""


def facts_of(model: Any, name: str) -> ModelFacts:
    """What ``model`` has; ``name`` is told in errors."""
    mujoco = engine()
    kinds = mujoco.mjtObj
    joints = tuple(_joint(model, number) for number in range(model.njnt) if _name(model, kinds.mjOBJ_JOINT, number))
    return ModelFacts(
        name=name,
        timestep_s=float(model.opt.timestep),
        cameras=_names(model, kinds.mjOBJ_CAMERA, model.ncam),
        joints=joints,
        actuators=tuple(
            _actuator(model, number) for number in range(model.nu) if _name(model, kinds.mjOBJ_ACTUATOR, number)
        ),
        sensors=tuple(
            _sensor(model, number, joints)
            for number in range(model.nsensor)
            if _name(model, kinds.mjOBJ_SENSOR, number)
        ),
        bodies=tuple(name for name in _names(model, kinds.mjOBJ_BODY, model.nbody) if name != "world"),
        keys=_names(model, kinds.mjOBJ_KEY, model.nkey),
        parents={
            _name(model, kinds.mjOBJ_BODY, number): _name(model, kinds.mjOBJ_BODY, int(model.body_parentid[number]))
            for number in range(1, model.nbody)
        },
    )


def _name(model: Any, kind: Any, number: int) -> str:
    return engine().mj_id2name(model, kind.value, number) or ""


def _names(model: Any, kind: Any, count: int) -> tuple[str, ...]:
    return tuple(name for name in (_name(model, kind, number) for number in range(count)) if name)


def _joint(model: Any, number: int) -> JointFact:
    kinds = engine().mjtObj
    span = Span(*map(float, model.jnt_range[number])) if model.jnt_limited[number] else None
    return JointFact(
        id=number,
        name=_name(model, kinds.mjOBJ_JOINT, number),
        kind=_JOINT_KINDS[int(model.jnt_type[number])],
        position_at=int(model.jnt_qposadr[number]),
        velocity_at=int(model.jnt_dofadr[number]),
        range=span,
        body=_name(model, kinds.mjOBJ_BODY, int(model.jnt_bodyid[number])),
    )


def _actuator(model: Any, number: int) -> ActuatorFact:
    mujoco = engine()
    transmission = int(model.actuator_trntype[number])
    is_joints = transmission in (mujoco.mjtTrn.mjTRN_JOINT.value, mujoco.mjtTrn.mjTRN_JOINTINPARENT.value)
    joint = _name(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.actuator_trnid[number][0])) if is_joints else ""
    span = Span(*map(float, model.actuator_ctrlrange[number])) if model.actuator_ctrllimited[number] else None
    return ActuatorFact(
        id=number,
        name=_name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, number),
        kind=_actuator_kind(model, number),
        joint=joint or None,
        range=span,
        gear=float(model.actuator_gear[number][0]),
    )


def _actuator_kind(model: Any, number: int) -> ActuatorKind:
    """What MuJoCo's shortcuts ``position`` and ``velocity`` make: a force of ``kp (ctrl - length)``, or of
    ``kv (ctrl - velocity)``."""
    mujoco = engine()
    is_affine = int(model.actuator_biastype[number]) == mujoco.mjtBias.mjBIAS_AFFINE.value
    gain = float(model.actuator_gainprm[number][0])
    _, of_length, of_velocity = map(float, model.actuator_biasprm[number][:3])
    is_integrated = int(model.actuator_dyntype[number]) == mujoco.mjtDyn.mjDYN_INTEGRATOR.value
    if not is_affine or is_integrated or gain <= 0:
        return "other"
    if of_length == -gain:
        return "position"
    return "velocity" if of_length == 0 and of_velocity == -gain else "other"


def _sensor(model: Any, number: int, joints: tuple[JointFact, ...]) -> SensorFact:
    mujoco = engine()
    kind = mujoco.mjtSensor(int(model.sensor_type[number])).name.removeprefix("mjSENS_").lower()
    target = (int(model.sensor_objtype[number]), int(model.sensor_objid[number]))
    slides = {one.id for one in joints if one.kind == "slide"}
    of_joint = _OF_A_JOINT.get(kind)
    return SensorFact(
        id=number,
        name=_name(model, mujoco.mjtObj.mjOBJ_SENSOR, number),
        kind=kind,
        at=int(model.sensor_adr[number]),
        size=int(model.sensor_dim[number]),
        target=target,
        reference=(int(model.sensor_reftype[number]), int(model.sensor_refid[number])),
        cutoff=float(model.sensor_cutoff[number]),
        unit=of_joint[target[1] in slides] if of_joint else _UNITS.get(kind, ""),
    )
