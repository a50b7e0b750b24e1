"""Connectors of a workbench, one of each kind."""
