"""``python -m mosaic_server run …`` is ``mosaic server run …``."""

from mosaic_server.cli import app

if __name__ == "__main__":
    app(prog_name="mosaic server")
