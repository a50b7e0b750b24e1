"""Puts the script that draws the site's diagrams into the site itself, on the pages that have any.

Left alone, the theme would load it from a server of others: a site that is read on a robot's network has no internet.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from mkdocs.utils import get_relative_url

SOURCE = Path(__file__).parents[1] / "dashboard/node_modules/@mermaid-js/tiny/dist/mermaid.tiny.js"
PLACE = "assets/javascripts/mermaid.js"
DIAGRAM = '<pre class="mermaid">'


def on_files(files: Files, config: Any) -> Files:
    """Add the script to the site."""
    if not SOURCE.exists():
        raise PluginError(f"{SOURCE} is missing: run `npm ci` in dashboard/, it draws the diagrams of the site")
    files.append(File.generated(config, PLACE, abs_src_path=str(SOURCE)))
    return files


def on_post_page(output: str, page: Page, config: Any) -> str:
    """Load it before the theme's own script, which looks for it."""
    if DIAGRAM not in output:
        return output
    script = f'<script src="{get_relative_url(PLACE, page.url)}"></script>'
    return output.replace("</head>", f"{script}</head>", 1)
