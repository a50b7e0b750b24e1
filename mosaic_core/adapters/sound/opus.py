"""The one codec of sound."""

OPUS = "audio/opus"
