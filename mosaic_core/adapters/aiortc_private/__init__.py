"""The one place that touches names which aiortc and aioice keep to themselves; one contract test holds each.

Those tests fail loudly when a new version changes one of them. Most are in
``tests/adapters/aiortc_private/test_aiortc_private_names.py``; those of ``dtls``, ``fair_turns``,
``quick_sctp``, ``receivers`` and ``reporting`` stand in their own files there.
``tests/architecture/test_aiortc_private_use.py`` sees that no other module uses such a name, and that each used here
has its test.
"""
