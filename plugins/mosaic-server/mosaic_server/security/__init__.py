"""Passwords, tokens, tickets and codes: everything that proves who somebody is."""
