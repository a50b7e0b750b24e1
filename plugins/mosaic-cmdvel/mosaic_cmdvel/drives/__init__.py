"""The drives that come with mosaic-cmdvel, one per module."""
