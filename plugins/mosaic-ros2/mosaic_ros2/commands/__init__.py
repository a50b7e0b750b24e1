"""The command ``mosaic ros2``: what is heard, what it says, and a file to start from."""
