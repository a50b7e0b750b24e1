"""Whole robots and operators on networks that can be made bad, without a server, a browser or root.

The kit for plugin authors (``mosaic_core.testing``), ``mosaic safety drill``, ``mosaic doctor`` and ``mosaic bench``
stand on it.
"""
