"""Restricts what texts of strangers may consist of."""

from __future__ import annotations

EMAIL = r"^[^@\s\x00-\x1f\x7f-\x9f]+@[^@\s\x00-\x1f\x7f-\x9f]+$"
NAME = r"^[^\x00-\x1f\x7f-\x9f]*$"
"""Names are printed on terminals, where control characters could act."""
NO_NUL = r"^[^\x00]*$"
"""PostgreSQL keeps no text with NUL."""
