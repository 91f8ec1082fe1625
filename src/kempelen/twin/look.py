"""Colours, wood and polish of what stands on the table: no contact depends on them, every camera does."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Share = Annotated[float, Field(ge=0, le=1)]
Colour = tuple[Share, Share, Share]


class Look(BaseModel):
    """What everything looks like; colours are red, green, blue from 0 to 1.

    Attributes:
        light: Squares.
        dark: Squares.
        border: The board around its squares.
        border_width: mm, to the board's edge.
        coordinates: Whether letters and digits stand on the border.
        line: Width of a line around the 64 squares, mm; 0 for none.
        grain: How much streaks of wood change the squares' brightness.
        table: Table top.
        cloth: How much a fine pattern changes the table top's brightness.
        room: Walls, where a camera sees any.
        tray: Trays.
        white: Pieces.
        black: Pieces.
        gloss: Of the pieces: 0 is felt, 1 is varnish.
        board_gloss: Of the board.
        carving: How far the pieces' outlines depart from the usual ones.
        skin: Of the person's hand.
        sleeve: Over the person's forearm.
        seed: Of grain and carving.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    light: Colour = (0.87, 0.74, 0.55)
    dark: Colour = (0.50, 0.32, 0.20)
    border: Colour = (0.42, 0.26, 0.16)
    border_width: Annotated[float, Field(ge=0, le=60)] = 12.0
    coordinates: bool = True
    line: Annotated[float, Field(ge=0, le=5)] = 0.0
    grain: Annotated[float, Field(ge=0, le=0.5)] = 0.06
    table: Colour = (0.35, 0.38, 0.36)
    cloth: Annotated[float, Field(ge=0, le=0.5)] = 0.04
    room: Colour = (0.55, 0.53, 0.50)
    tray: Colour = (0.87, 0.74, 0.55)
    white: Colour = (0.93, 0.86, 0.72)
    black: Colour = (0.22, 0.15, 0.12)
    gloss: Share = 0.5
    board_gloss: Share = 0.15
    carving: Share = 0.0
    skin: Colour = (0.80, 0.58, 0.47)
    sleeve: Colour = (0.22, 0.27, 0.42)
    seed: Annotated[int, Field(ge=0)] = 0


DEFAULT_LOOK = Look()
