"""Connector `recorder`: cameras of the robot into files, without encoding them again."""
