"""The widgets that installed distributions ship."""
