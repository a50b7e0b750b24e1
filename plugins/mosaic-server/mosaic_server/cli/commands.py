"""The command tree. Exit codes: 0 fine, 2 usage or configuration, 1 the rest."""

from __future__ import annotations

import typer

from mosaic_server.cli import audit, grants, ice, organization, robot, run, setup, user

app = typer.Typer(
    name="server",
    add_completion=False,
    help="The MOSAIC server: signaling, accounts, robots, dashboard.",
    no_args_is_help=True,
)
app.command("run")(run.run)
app.command("init")(setup.init)
app.command("seed")(setup.seed)
app.command("organization")(organization.organization)
app.command("audit")(audit.audit)
app.add_typer(user.app, name="user")
app.add_typer(robot.app, name="robot")
app.add_typer(ice.app, name="ice")
robot.app.command("grant")(grants.grant)
robot.app.command("revoke")(grants.revoke)
robot.app.command("grants")(grants.grants)
