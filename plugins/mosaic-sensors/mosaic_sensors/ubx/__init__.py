"""GNSS receivers of u-blox in their own protocol, UBX, with corrections for them."""
