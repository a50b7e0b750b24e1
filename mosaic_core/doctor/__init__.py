"""Examines this machine and the way to its server: the checks behind ``mosaic doctor``.

A check is an async generator of findings. All run side by side, each with its own time-out, so that one dead server
costs no other check its time. What findings *mean* is decided in ``machines``; ``adapters`` hold the probes.
"""
