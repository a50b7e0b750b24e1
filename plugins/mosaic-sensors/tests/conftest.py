"""Settings of this plugin's tests."""

from hypothesis import settings

settings.register_profile("mosaic", deadline=None)  # a busy machine is no failure of pure logic
settings.load_profile("mosaic")
