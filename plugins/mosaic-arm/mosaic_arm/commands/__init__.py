"""``mosaic arm``: calibrate an arm by hand, and have one arm follow another."""
