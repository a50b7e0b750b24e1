"""Parts of `bench/arm.py`."""
