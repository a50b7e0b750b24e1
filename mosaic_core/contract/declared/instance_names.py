"""Refuses attributes that an instance sets and that hide the framework's own, or look as if the framework read them."""

from __future__ import annotations

from mosaic_core.contract.declared.attribute_reads import package_reads
from mosaic_core.contract.declared.class_names import ANOTHER_NAME, BODIES, OWNED, VALUES
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.contract.host import UnboundHost
from mosaic_core.words.errors import slip_of

_READ_OF_THE_CLASS = {
    "data_type": "Give yours another name: what it carries follows from its base.",
    "kind": "Give yours another name: what it carries follows from its base.",
    "sends": "Write it in the body of the class: sends = ….",
}
"""Values that an instance can't say, and what to do about each."""


def check_instance_names(handler: object) -> None:
    """Refuse what ``handler``, which is not bound yet, has set in ``__init__`` under a name that means something
    else, and a misspelt value that nothing reads, not even its author's code."""
    cls, own = type(handler), vars(handler)
    for name, cure in _READ_OF_THE_CLASS.items():
        if name in own and hasattr(cls, name):
            raise wrong_declaration(cls, f"it sets {name}, which is read of its class.", cure)
    for name in own:
        is_hidden = hasattr(cls, name) and (name in OWNED or (name in BODIES and not callable(own[name])))
        if is_hidden or (name == "_host" and not isinstance(own[name], UnboundHost)):
            raise wrong_declaration(cls, f"it sets {name}, which is the framework's own.", ANOTHER_NAME)
    for name in own:
        known = [one for one in VALUES if hasattr(cls, one) and one not in own and one[0] == name[0]]
        meant = slip_of(name, known) if name not in VALUES and not hasattr(cls, name) else None
        is_plural = meant is not None and meant.removesuffix("s") == name.removesuffix("s")
        if meant is not None and not is_plural and not package_reads(cls, {name}):
            message = f"it sets '{name}', which nothing reads; did you mean '{meant}'?"
            raise wrong_declaration(cls, message, f"Write {meant}, or leave it out.")
