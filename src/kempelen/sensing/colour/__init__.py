"""What stands on each square, from a colour picture alone.

`reader.ColourReader` is calibrated from a position that is known (the start of a game, and every move that
is confirmed), so it needs no idea of what chess pieces look like:

* `columns` cuts the upright column over each square out of a picture, leaning as the camera sees it;
* `register` lays a picture over an earlier one, by smooth `fields` over the board;
* `light` turns colours into numbers on which a lamp, an exposure or a white balance only adds a constant;
* `looks` sums up what a column looks like, and how much it changed;
* `predictive` says how likely a look is for a class of which few examples were seen.

No I/O and no clock; deterministic.
"""
