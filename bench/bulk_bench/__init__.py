"""Parts of `command_beside_bulk.py`."""
