"""Looks whether an author's own code reads an attribute, before its name is called one that nobody reads."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Collection


def package_reads(kind: type, names: Collection[str]) -> bool:
    """Whether a module of its package, as far as that is imported, reads an attribute of one of these names; true
    where the source of its own module can't be read."""
    own, top = kind.__module__, kind.__module__.partition(".")[0]
    mentioned = re.compile(rf"\b(?:{'|'.join(map(re.escape, names))})\b")
    for name in sorted((name for name in sys.modules if name.partition(".")[0] == top), key=lambda name: name != own):
        try:
            source = inspect.getsource(sys.modules[name])
            if name != own and not (names and mentioned.search(source)):
                continue  # to parse all of a big package would take seconds
            tree = ast.parse(source)
        except (OSError, TypeError, SyntaxError):
            if name == own:
                return True
            continue
        reads = (one for one in ast.walk(tree) if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Load))
        if any(one.attr in names for one in reads):
            return True
    return False
