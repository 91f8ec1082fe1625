"""Finding the board."""
