"""Looks whether an author's own code reads an attribute, before its name is called one that nobody reads."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Collection


def package_reads(kind: type, names: Collection[str]) -> bool:
    """Whether a module of its package, as far as that is imported, reads an attribute of one of these names; true
    where the source of its own module can't be read."""
    top = kind.__module__.partition(".")[0]
    for module in [one for name, one in sys.modules.items() if name.partition(".")[0] == top]:
        try:
            tree = ast.parse(inspect.getsource(module))
        except (OSError, TypeError, SyntaxError):
            if module.__name__ == kind.__module__:
                return True
            continue
        reads = (one for one in ast.walk(tree) if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Load))
        if any(one.attr in names for one in reads):
            return True
    return False
