"""Finding the board in a picture: from colour alone, and from depth and colour."""
