"""The pages in Chromium that watch pictures and clouds, by each of the ways."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from glass_bench.page import SCRIPTS

HERE = Path(__file__).parent
DASHBOARD = HERE.parents[1] / "dashboard"
SOCKETS = (HERE / "socket_page.js").read_text()
BUNDLE = """
import {{ readFileSync }} from 'node:fs'
import {{ build }} from 'vite'
const {{ compilerOptions }} = JSON.parse(readFileSync('tsconfig.json', 'utf8'))
const alias = Object.entries(compilerOptions.paths).map(([name, [file]]) => ({{
  find: new RegExp(`^${{name}}$`), replacement: `${{process.cwd()}}/${{file}}`,
}}))
await build({{
  configFile: false, logLevel: 'error', resolve: {{ alias }},
  build: {{
    outDir: {folder}, emptyOutDir: true, minify: false,
    lib: {{ entry: {entry}, formats: ['iife'], name: 'page', fileName: () => 'page.js' }},
  }},
}})
"""


def mosaic_script(folder: Path) -> str:
    """The page of an operator, built of the dashboard's packages into ``folder``."""
    entry, target = json.dumps(str(HERE / "mosaic_page.ts")), json.dumps(str(folder))
    words = ["node", "--input-type=module", "-e", BUNDLE.format(entry=entry, folder=target)]
    subprocess.run(words, cwd=DASHBOARD, check=True)
    return SCRIPTS + ";\n" + (folder / "page.js").read_text()
