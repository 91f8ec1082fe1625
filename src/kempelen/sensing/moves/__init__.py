"""Which move was made: from observations and the rules alone.

`reader.MoveReader` names moves, `check.PositionCheck` compares the table with what should stand there,
`placement.read_position` reads a position that has no history. No I/O, no clock of its own: times are those
of the observations.
"""
