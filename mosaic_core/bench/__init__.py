"""Measures delays and pictures for ``mosaic bench``: a real robot and a real operator over a bad network in user
space."""
