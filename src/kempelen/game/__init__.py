"""Rules, notation, players, journal and the arbiter that owns the game."""
