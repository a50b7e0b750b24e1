"""An autopilot that is made up: real MAVLink over real UDP, without a vehicle."""
