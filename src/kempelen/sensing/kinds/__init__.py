"""Which piece is which: the classifier for positions without history, promotions and set-up."""
