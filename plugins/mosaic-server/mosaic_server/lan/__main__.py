"""``python -m mosaic_server.lan``: the child of a robot."""

from mosaic_server.lan.child import main

main()
