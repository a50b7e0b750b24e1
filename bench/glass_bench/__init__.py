"""What `glass_to_glass.py` and `viewers_come_and_go.py` measure with."""
