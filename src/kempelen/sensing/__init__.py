"""Eyes: the board found in pictures, what stands on it, and the move that was made."""
