"""What `bench/data.py` connects: ends of one data-channel connection on different stacks, each in its own process."""
