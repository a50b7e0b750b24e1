"""The kit for plugin authors: no network, no sleeping. See ``mosaic_core.testing.bench`` for the bench itself."""
