"""The twin's reed board: switches, magnets, wires and the scan, at the far end of a pseudo-terminal."""
