"""MQTT for MOSAIC: topics of a broker become messages to operators, and their commands are published."""
