"""The command tree of ``mosaic ros2``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_core.cli.terminal.error_report import usage
from mosaic_core.cli.terminal.plain_table import print_table

if TYPE_CHECKING:
    from mosaic_ros2.bus.shared_bus import BusChoice

app = typer.Typer(
    name="ros2",
    add_completion=False,
    help="What is heard of ROS 2: topics, messages, services, and a robot's file.",
    no_args_is_help=True,
)

Domain = Annotated[int | None, typer.Option(help="ROS_DOMAIN_ID of the nodes; default: this shell's.", min=0, max=232)]
Transport = Annotated[str, typer.Option(help="dds, or zenoh for nodes of rmw_zenoh.")]
Interface = Annotated[str, typer.Option(help="DDS: network interface or its address, lo say.")]
Peers = Annotated[
    list[str] | None,
    typer.Option("--peer", help="DDS: a host beyond multicast. Zenoh: a router's endpoint."),
]
Definitions = Annotated[
    list[str] | None, typer.Option("--definitions", help="A .msg file or a package's folder, for types of your own.")
]
Wait = Annotated[float, typer.Option(help="Seconds to listen.", min=0.1, max=600)]
ShowsAll = Annotated[bool, typer.Option("--all", help="Also what ROS keeps to itself: parts of actions, parameters.")]


@app.command()
def topics(
    domain: Domain = None,
    transport: Transport = "dds",
    interface: Interface = "",
    peer: Peers = None,
    wait: Wait = 2.0,
    shows_all: ShowsAll = False,
) -> None:
    """List the topics that are heard, with their types and what their publishers offer."""
    from mosaic_ros2.commands.hearing import heard, topic_rows

    rows = topic_rows(heard(_choice(domain, transport, interface, peer, None), wait), shows_all=shows_all)
    print_table(("topic", "type", "publishers", "subscriptions", "offered"), rows, folded=1)


@app.command()
def services(
    domain: Domain = None,
    transport: Transport = "dds",
    interface: Interface = "",
    peer: Peers = None,
    wait: Wait = 2.0,
    shows_all: ShowsAll = False,
) -> None:
    """List the services and actions that are heard, and whether they can be called from here."""
    from mosaic_ros2.bus.silence import why_foreign_services
    from mosaic_ros2.commands.hearing import heard, service_rows

    found = heard(_choice(domain, transport, interface, peer, None), wait)
    print_table(("name", "kind", "type", "callable"), service_rows(found, shows_all=shows_all), folded=3)
    _tell(why_foreign_services(found))


@app.command()
def echo(
    topic: Annotated[str, typer.Argument(help="The topic, like /scan.")],
    type_name: Annotated[str, typer.Option("--type", help="Its type; default: what its publisher has.")] = "",
    count: Annotated[int, typer.Option(help="End after so many messages; 0: never.", min=0)] = 0,
    domain: Domain = None,
    transport: Transport = "dds",
    interface: Interface = "",
    peer: Peers = None,
    definitions: Definitions = None,
    wait: Wait = 5.0,
) -> None:
    """Print a topic's messages, one JSON object a line, as an operator would get them."""
    from mosaic_ros2.commands.hearing import echoed

    try:
        for line in echoed(_choice(domain, transport, interface, peer, definitions), topic, type_name, wait, count):
            typer.echo(line)
    except KeyboardInterrupt:
        raise typer.Exit(130) from None


@app.command()
def init(
    output: Annotated[Path, typer.Argument(help="The file to write; - for the terminal.")] = Path("mosaic_config.yaml"),
    domain: Domain = None,
    transport: Transport = "dds",
    interface: Interface = "",
    peer: Peers = None,
    wait: Wait = 3.0,
    force: Annotated[bool, typer.Option(help="Overwrite a file that is there.")] = False,
) -> None:
    """Write a robot's YAML file with a connector for everything that is heard."""
    from mosaic_ros2.bus.silence import why_foreign_services
    from mosaic_ros2.commands.hearing import heard
    from mosaic_ros2.commands.robot_file import robot_file

    to_terminal = str(output) == "-"
    if not to_terminal and output.exists() and not force:
        usage(f"{output} is there already; --force overwrites it")
    choice = _choice(domain, transport, interface, peer, None)
    found = heard(choice, wait)
    text, count = robot_file(found, choice)
    _tell(why_foreign_services(found))
    if to_terminal:
        typer.echo(text, nl=False)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        usage(f"{output} can't be written: {error.strerror}; name a file in a folder that you may write")
    typer.echo(f"{output}: {count} connectors. Look through it, then: mosaic validate {output}")
    typer.echo(f"On its own: mosaic run {output} --serve 127.0.0.1:9002")


def _tell(sentence: str) -> None:
    """Beside what programs read."""
    if sentence:
        typer.echo(sentence, err=True)


def _choice(
    domain: int | None, transport: str, interface: str, peers: list[str] | None, definitions: list[str] | None
) -> BusChoice:
    from mosaic_ros2.commands.hearing import chosen

    if transport not in ("dds", "zenoh"):
        usage(f"no transport {transport!r}. There are: dds, zenoh")
    return chosen(domain, transport, interface, peers or [], definitions or [])
