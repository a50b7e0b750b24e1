"""The safety drill: what a configuration's receivers really do when an operator falls silent, leaves, lies, says stop.

The real configurers, safety models, time-outs and robot; server and network are in memory. In a dry drill, which is
the default, what would touch a device is replaced by a recorder.
"""
