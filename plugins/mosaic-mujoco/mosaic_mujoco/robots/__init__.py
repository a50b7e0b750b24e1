"""The models that come with this package, and their robots' files: `arm` and `vehicle`."""
