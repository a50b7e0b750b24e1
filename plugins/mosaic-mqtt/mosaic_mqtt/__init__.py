"""MQTT for MOSAIC: topics of a broker become messages to operators."""
