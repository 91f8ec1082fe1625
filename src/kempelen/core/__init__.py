"""The vocabulary of the house: geometry, places, pieces, table, protocols, errors. No I/O."""
