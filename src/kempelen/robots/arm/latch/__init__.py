"""The older arm's open serial bridge: parallel latches with four phase bits for each motor behind it."""
