"""Refuses names in the body of a class that look as if the framework read them: those that are almost one of the
contract's, and those that only another base has.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Mapping

from mosaic_core.contract.declared.code_lines import caller
from mosaic_core.contract.declared.wrong_declaration import wrong_declaration
from mosaic_core.words.errors import MosaicError, slip_of

BODIES: Mapping[str, str] = {
    "messages": "DataChannelSendable", "handle_data": "DataChannelReceivable", "make_safe": "DataChannelReceivable",
    "reported_position": "DataChannelReceivable", "peer_left": "DataChannelReceivable", "answer": "RequestHandler",
    "frames": "MediaTrackHandler", "sounds": "AudioTrackHandler", "handle_sound": "AudioReceivable",
    "talk_ended": "AudioReceivable", "configure": "Configurer",
}  # fmt: skip
"""What the framework calls, and the base whose subclasses it calls it on."""
VALUES: Mapping[str, str] = {
    "delivery": "Handler", "is_for_originals": "Handler", "is_part": "Handler", "runs": "Handler", "widget": "Handler",
    "item_names": "DataChannelReceivable", "limits": "DataChannelReceivable", "motion_fields": "DataChannelReceivable",
    "position_fields": "DataChannelReceivable", "requires_lease": "DataChannelReceivable",
    "resource": "DataChannelReceivable", "takes_observers": "DataChannelReceivable",
    "timeout_s": "DataChannelReceivable", "sends": "DataChannelBidirectional", "answer_within_s": "RequestHandler",
    "at_once": "RequestHandler", "encoding": "MediaTrackHandler", "packet_codec": "MediaTrackHandler",
    "connector_type": "Configurer", "example": "Configurer", "is_called_as_by_originals": "Configurer",
    "params_model": "Configurer", "safety_model": "Configurer", "trial": "Configurer",
}  # fmt: skip
"""What the framework reads in the body of a class, and the base whose subclasses have it."""
_COMMON = frozenset({"answer", "configure", "encoding", "example", "packet_codec", "trial"})
"""Words that an author may well mean otherwise where nothing of MOSAIC is called so."""
_INSTEAD = (("messages", "frames", "sounds"), ("handle_data", "handle_sound"))
"""Bodies that do the same, each of another base."""
_SYNONYMS: Mapping[str, str] = {
    "needs_lease": "requires_lease", "needs_a_lease": "requires_lease", "lease_required": "requires_lease",
}  # fmt: skip
"""What an author may call a word of the contract."""
_IN_THE_FILE = "Write it in `safety:` of the robot's file, or as a default of the configurer's safety_model."
_BY_THE_BASE = "Leave it out: it follows from the base and the type in its brackets."
_OF_HANDLERS: Mapping[str, str] = {
    "label": "Leave it out: the configurer gives it to __init__.",
    "data_type": _BY_THE_BASE, "direction": _BY_THE_BASE, "kind": _BY_THE_BASE,
    "lease": 'Write requires_lease = True, and resource = "…" for a lease of its own.',
    "safety": "Write its parts one by one: timeout_s, requires_lease, resource, limits.",
    "max_rate_hz": _IN_THE_FILE, "on_timeout": _IN_THE_FILE, "on_loss": _IN_THE_FILE, "slow_down": _IN_THE_FILE,
}  # fmt: skip
"""Values that a handler's class can't say, and where they are said."""
_OF_CONFIGURERS: Mapping[str, str] = {
    "Params": "Write that class above, and name it in the brackets of the base: DataChannelConfigurer[MyParams].",
    "params": "Name their class in the brackets of the base: DataChannelConfigurer[MyParams].",
    "label": "Leave it out: the robot's file says it.",
    "safety": "Write defaults in a subclass of SafetyConfig, and name it: safety_model = MySafety.",
    "shared": "Leave it out: the robot gives it to __init__.",
}
OWNED = frozenset({
    "every", "pause", "is_stopping", "monotonic_s", "count_loss", "tap_media", "tap_pictures", "tap_data", "direction",
    "send", "send_json", "send_string", "send_bytes", "send_burst", "send_frame", "send_sound", "_send", "_host",
})  # fmt: skip
"""What every handler has from the framework, which calls it itself."""
ANOTHER_NAME = "Give yours another name: who calls this one means the framework's."
_API_VERSION = "MOSAIC_API_VERSION"


def check_names(cls: type) -> None:
    """Refuse names in the body of ``cls`` that nothing reads, though they look like it."""
    if _API_VERSION in vars(cls):
        message = f"{_API_VERSION} stands in the class, and is read from its module."
        raise wrong_declaration(cls, message, "Write it above the class, at the left margin.")
    _check_annotations(cls)
    _check_bind(cls)
    elsewhere = _OF_HANDLERS if hasattr(cls, "bind") else _OF_CONFIGURERS
    for name, value in vars(cls).items():
        if name in elsewhere and (isinstance(value, type) or not (callable(value) or hasattr(value, "__get__"))):
            raise wrong_declaration(cls, f"nobody reads the {name} of its class.", elsewhere[name])
        if name in OWNED and any(hasattr(base, name) for base in cls.__mro__[1:]):
            raise wrong_declaration(cls, f"{name} is the framework's own.", ANOTHER_NAME)
        if name.startswith("_") or any(hasattr(base, name) for base in cls.__mro__[1:]):
            continue
        is_called = isinstance(value, classmethod | staticmethod) or (callable(value) and not isinstance(value, type))
        owner = None if name in _COMMON else (BODIES if is_called else VALUES).get(name)
        if owner is not None:
            verb = "calls" if is_called else "reads"
            message = f"nobody {verb} its {name}{'()' if is_called else ''}."
            cure = f"derive it from {owner}, or give {'the method' if is_called else 'it'} another name."
            cure = f"Write {meant}(), or {cure}" if (meant := _meant_body(cls, name)) else f"D{cure[1:]}"
            raise wrong_declaration(cls, message, cure)
        if name.islower() or not isinstance(value, type):  # else a class in the class, which is written like that
            _check_spelling(cls, name, BODIES if is_called else VALUES)


def _check_bind(cls: type) -> None:
    """Refuse a ``bind`` that is not the framework's, which is called with what the handler stands on."""
    bind = vars(cls).get("bind")
    if bind is None or not hasattr(super(cls, cls), "bind"):
        return
    try:
        inspect.signature(bind).bind(None, None)
    except (TypeError, ValueError):
        cure = "Give yours another name, or write def bind(self, host), which begins with super().bind(host)."
        raise wrong_declaration(cls, "bind is the framework's own, and called with a host.", cure) from None


def _meant_body(cls: type, name: str) -> str:
    """What its base calls the body that is called ``name`` elsewhere; empty where it has none."""
    alike = next((its for its in _INSTEAD if name in its), ())
    return next((one for one in alike if hasattr(cls, one) and one not in vars(cls)), "")


def _check_annotations(cls: type) -> None:
    """Refuse a value behind a colon: it is taken for a type, and nothing is set."""
    try:
        annotations = inspect.get_annotations(cls)
    except NameError:  # of a name that only a type checker imports
        return
    for name, said in annotations.items():
        value = _literal(said)
        if name in VALUES and name not in vars(cls) and isinstance(value, bool | int | float | tuple | dict):
            raise wrong_declaration(
                cls, f"{name} is annotated with {value!r}, and not set.", f"Write {name} = {value!r}."
            )


def _literal(annotation: object) -> object:
    if not isinstance(annotation, str):
        return annotation
    try:
        value: object = ast.literal_eval(annotation)
    except (ValueError, SyntaxError):
        return None
    return value


def check_derived(cls: type) -> None:
    """Refuse an instance of a base itself: what travels is said where a class derives from it."""
    if not hasattr(cls, "data_type"):
        cure = f"Derive a class of your own: `class Mine({cls.__qualname__}[…])`, and make that."
        message = f"{caller().heading}{cls.__qualname__} itself does not know what it carries. {cure}"
        raise MosaicError(message, code="config.broken_plugin", cure=cure)


def _check_spelling(cls: type, name: str, words: Iterable[str]) -> None:
    """Refuse a name that is almost one that this class could have and does not write itself."""
    word = _word_meant(name, [one for one in words if hasattr(cls, one) and one not in vars(cls)])
    if word is not None:
        message = f"it has '{name}', which nothing reads; did you mean '{word}'?"
        raise wrong_declaration(cls, message, f"Write {word}, or begin a name of your own with _.")


def _word_meant(name: str, words: Iterable[str]) -> str | None:
    """The one of these words that ``name`` is in other letters, or almost. What is written like a constant must be a
    word letter by letter, and one of several parts: ``LIMITS`` may well be the author's own."""
    known, written = {one.removesuffix("s"): one for one in words}, _SYNONYMS.get(name, name).lower().removesuffix("s")
    if name.isupper():
        return known.get(written) if "_" in name else None
    found = slip_of(written, [one for one in known if one[0] == written[0]]) if written else None
    return None if found is None else known[found]
