"""Checks what everybody needs who installs a plugin: it loads, it says what it is and what it takes."""

from __future__ import annotations

import re
from collections.abc import Iterator

from mosaic_core.contract.configurer import API_VERSION, Configurer
from mosaic_core.doctor.unmet_dependencies import unmet_dependencies
from mosaic_core.harness.building import build
from mosaic_core.ladder.examinee import Examinee
from mosaic_core.ladder.fault import DoesNotApply, Fault, NotJudged
from mosaic_core.ladder.rule import ConnectorRule, ShipmentRule
from mosaic_core.ladder.shipment import Shipment
from mosaic_core.ladder.source_places import place_of_attribute, place_of_class, place_of_field
from mosaic_core.runtime.configuration.plugin_loading import api_version
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.widgets.page_faults import page_faults
from mosaic_core.runtime.widgets.widget_modules import is_shipped, module_with
from mosaic_core.words.errors import CodeLine, ConfigError, MosaicError

_KEBAB = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
_MAX_DOCSTRING = 110
"""Characters: one line of `mosaic connectors list`."""


def loads(one: Examinee) -> Iterator[Fault]:
    loaded = one.loaded
    if isinstance(loaded, Fault):
        yield loaded


def is_configurer(one: Examinee) -> Iterator[Fault]:
    loaded = one.loaded
    if isinstance(loaded, Fault):
        raise NotJudged("its code can't be imported")
    if not (isinstance(loaded, type) and issubclass(loaded, Configurer)):
        yield Fault(f"{one.entry_point.value} is no subclass of Configurer", one.entry_place)
    elif missing := sorted(getattr(loaded, "__abstractmethods__", ())):
        yield Fault(f"{loaded.__name__} does not implement {', '.join(missing)}", place_of_class(loaded))


def speaks_api(one: Examinee) -> Iterator[Fault]:
    version = api_version(one.configurer)
    if version != API_VERSION:
        yield Fault(f"it says MOSAIC_API_VERSION = {version!r}, this mosaic-core speaks {API_VERSION}", one.place)


def type_is_its_name(one: Examinee) -> Iterator[Fault]:
    said = one.configurer.connector_type
    if said != one.connector_type:
        place = place_of_attribute(one.configurer, "connector_type") if said else one.place
        yield Fault(f"connector_type is {said!r}, its entry point is called {one.connector_type!r}", place)
    if not one.configurer.is_called_as_by_originals and not _KEBAB.fullmatch(one.connector_type):
        yield Fault(f"{one.connector_type!r} is not written in small letters joined by -", one.entry_place)


def nobody_else_has_it(one: Examinee) -> Iterator[Fault]:
    claims = [found for found in ConnectorResolver().types() if found.type == one.connector_type]
    others = {found.source for found in claims if not one.shipment.is_called(found.distribution)}
    if others:
        yield Fault(f"{', '.join(sorted(others))} has the type {one.connector_type!r} too", one.entry_place)


def says_what_it_is(one: Examinee) -> Iterator[Fault]:
    said = (vars(one.configurer).get("__doc__") or "").strip().partition("\n")[0]
    if not said:
        yield Fault(f"{one.configurer.__name__} has no docstring", one.place)
    elif len(said) > _MAX_DOCSTRING:
        yield Fault(f"its first line has {len(said)} characters, {_MAX_DOCSTRING} are shown", one.place)


def params_are_documented(one: Examinee) -> Iterator[Fault]:
    for model in one.param_models():
        for name, info in model.model_fields.items():
            if not (info.description or "").strip():
                yield Fault(f"{model.__name__}.{name} has no description", place_of_field(model, name))


def configures(one: Examinee) -> Iterator[Fault]:
    for params, what in ((one.example, "its example"), (one.trial, "its trial")):
        try:
            build(one.configurer, params=params)
            one.configured(params)
        except ConfigError as error:
            said = "; ".join(problem.message for problem in error.problems)
            yield Fault(f"with the params of {what} it is refused: {said}", _place_of_configure(one, what))
        except Exception as error:  # noqa: BLE001 - a plugin's code may fail in any way
            yield one.fault(error, f"with the params of {what} it raises")
        if one.trial == one.example:
            break


def brings_its_widgets(one: Examinee) -> Iterator[Fault]:
    named = [handler for handler in one.handlers if handler.widget is not None and is_shipped(handler.widget)]
    if not named:
        raise DoesNotApply("it names no widget of a distribution")
    for handler in named:
        hint = str(handler.widget)
        try:
            module = module_with(hint, one.shipment.widgets)
        except MosaicError as error:
            place = place_of_attribute(type(handler), "widget")
            yield Fault(f"{type(handler).__name__} names the widget '{hint}': {error.message}", place)
            continue
        for fault in page_faults(module.content.decode(), hint.partition("/")[2]):
            message = f"the page can't load the widget '{hint}': it {fault.message}"
            yield Fault(message, CodeLine(str(module.path), fault.line))


def _place_of_configure(one: Examinee, what: str) -> CodeLine:
    name = "trial" if what == "its trial" else "example"
    return place_of_attribute(one.configurer, name if name in vars(one.configurer) else "configure")


def has_licence(one: Shipment) -> Iterator[Fault]:
    named = one.metadata.get("License-Expression") or one.metadata.get("License")
    if not named and not any(text.startswith("License ::") for text in one.metadata.get("Classifier", ())):
        yield Fault("no licence is named", CodeLine(one.metadata_file))


def has_readme(one: Shipment) -> Iterator[Fault]:
    if not any(text.strip() for text in one.metadata.get("Description", ())):
        yield Fault("there is no readme", CodeLine(one.metadata_file))


def names_its_python(one: Shipment) -> Iterator[Fault]:
    if not one.metadata.get("Requires-Python"):
        yield Fault("it does not say which Python it needs", CodeLine(one.metadata_file))


def finds_its_dependencies(one: Shipment) -> Iterator[Fault]:
    for unmet in unmet_dependencies(one.metadata.get("Requires-Dist", ())):
        yield Fault(f"{one.source} {unmet.message}: {unmet.cure}", CodeLine(one.metadata_file))


def is_typed(one: Shipment) -> Iterator[Fault]:
    folders = list(one.folders())
    for folder in folders:
        if not (folder / "py.typed").is_file():
            yield Fault(f"{folder.name}/py.typed is missing", CodeLine(str(folder)))
    if not folders and one.code():
        yield Fault("a module that stands alone can't carry py.typed", CodeLine(str(one.code()[0])))


BRONZE = (
    ConnectorRule(
        "loads", "bronze", "The entry point can be imported.",
        "A robot whose file names the type does not start.",
        "Mend the line that is named; what is imported belongs in the dependencies.", loads,
    ),
    ConnectorRule(
        "is-a-configurer", "bronze", "It names a complete subclass of `Configurer`.",
        "Nothing else can check params and make a handler.",
        "Derive the class from DataChannelConfigurer or MediaTrackConfigurer, and write configure().", is_configurer,
    ),
    ConnectorRule(
        "api-version", "bronze", "It is written for the contract that this mosaic-core has.",
        "A plugin for another one is refused when the robot starts.",
        f"Go through the changelog, then write MOSAIC_API_VERSION = {API_VERSION}, or leave it out.", speaks_api,
    ),
    ConnectorRule(
        "type-name", "bronze", "`connector_type` is the name of the entry point, in kebab-case.",
        "The YAML file, `mosaic connectors list` and the code would call it by different names.",
        "Name both alike: connector_type = \"my-sensor\", and the entry point my-sensor.", type_is_its_name,
    ),
    ConnectorRule(
        "only-owner", "bronze", "No other installed distribution has the same type.",
        "A robot refuses a type that two claim, whoever came second.",
        "Choose a name with yours in it, such as acme-lamp.", nobody_else_has_it,
    ),
    ConnectorRule(
        "docstring", "bronze", "The configurer's docstring begins with a line that says what it is.",
        "It is all that `mosaic connectors list` and the page show of it.",
        "Write one line below the class: what it sends or moves.", says_what_it_is,
    ),
    ConnectorRule(
        "params-described", "bronze", "Each field of `params` has a description.",
        "Editors, `mosaic connectors show` and the documentation are made from it.",
        'Write Field(description="…").', params_are_documented,
    ),
    ConnectorRule(
        "configures", "bronze", "It can be configured with the params of its example, without a device.",
        "The example is what people paste; devices are opened by the body, which is tried again.",
        "Give params defaults or the class an `example`, and open nothing in configure().", configures,
    ),
    ConnectorRule(
        "widget", "bronze", "A widget that it names is in the distribution, and a page can load it.",
        "A robot does not start without the file; a page that can't load it shows another widget.",
        "Mend the file that is named: an ES module that exports the component and apiVersion.", brings_its_widgets,
    ),
    ShipmentRule(
        "licence", "bronze", "The distribution names its licence.",
        "Nobody may use what has none.", 'Write license = "Apache-2.0", or yours, into pyproject.toml.', has_licence,
    ),
    ShipmentRule(
        "readme", "bronze", "The distribution has a readme.",
        "It is the page that people see before they install it.",
        'Write README.md, and readme = "README.md" into pyproject.toml.', has_readme,
    ),
    ShipmentRule(
        "requires-python", "bronze", "The distribution says which Python it needs.",
        "pip installs it where it can't run otherwise.",
        'Write requires-python = ">=3.11" into pyproject.toml.', names_its_python,
    ),
    ShipmentRule(
        "dependencies", "bronze", "What it depends on is installed here, in a version that it takes.",
        "What it was examined with is not what it asks for.",
        "Install what is named, or write the versions with which it works into pyproject.toml.", finds_its_dependencies,
    ),
    ShipmentRule(
        "py-typed", "bronze", "Its package has a `py.typed`.",
        "Type checkers ignore the annotations of whoever uses it otherwise.",
        "Add an empty file py.typed beside __init__.py.", is_typed,
    ),
)  # fmt: skip
"""In the order in which they are asked and told."""
