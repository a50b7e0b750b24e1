"""Connectors of a workbench: a thermometer and a lamp."""
