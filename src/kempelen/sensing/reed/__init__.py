"""The reed board: its driver, and what stands where from the order in which pieces are lifted and set."""
