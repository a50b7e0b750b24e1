"""What `bench/video.py` measures."""
