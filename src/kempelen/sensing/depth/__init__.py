"""What depth says about the squares: heights over an empty-board reference, and the hand above them."""
