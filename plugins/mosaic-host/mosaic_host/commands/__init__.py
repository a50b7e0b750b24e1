"""Programs that the robot's file allows operators to run."""
