"""Cameras, video files, network streams and a test pattern for MOSAIC."""
