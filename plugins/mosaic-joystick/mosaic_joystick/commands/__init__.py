"""``mosaic joystick``: which sticks there are, and driving by one."""
