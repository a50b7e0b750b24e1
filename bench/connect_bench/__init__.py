"""Parts of `bench/connect.py`."""
