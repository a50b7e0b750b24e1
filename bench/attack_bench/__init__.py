"""Parts of `bench/server_attacks.py`: the stranger, and the people beside."""
