"""The connectors: what stands in a robot's YAML file."""
