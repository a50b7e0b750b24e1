"""CAN buses: frames, signals and commands."""
