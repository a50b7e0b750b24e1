"""Parts of `startup.py`: what a robot's process holds in memory."""
