"""The quality ladder: what people may expect of a plugin, rung by rung, each rule checked by code.

A plugin is looked at as it is installed or as its folder holds it; its connectors are made and run in this process,
with the params that their authors name for it.
"""
