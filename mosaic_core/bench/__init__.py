"""What ``mosaic bench`` measures: a real robot and a real operator over a bad network in user space."""
