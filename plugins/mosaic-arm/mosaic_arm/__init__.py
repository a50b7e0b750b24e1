"""Arms of serial servos: joints, state, gripper, poses, freedrive, health."""
