"""`kempelen arm grasp`: the error that a grasp forgives, by kind of piece and tilt."""

from collections.abc import Sequence
from math import degrees, radians
from pathlib import Path

import chess
import typer
from rich.console import Console
from rich.table import Table as Rows

from kempelen.app.arm_setup import arm_setup
from kempelen.app.config import load_config
from kempelen.bench.svg_plot import Chart, draw_charts
from kempelen.cli.showing import require_writable
from kempelen.core.pieces import KINDS
from kempelen.twin.physics.margin import Margin, grasp_margins


def show_margins(tilts: Sequence[float], picture: Path | None, config: Path | None) -> None:
    """Try it out and show it.

    Args:
        tilts: Degrees.
        picture: SVG file to write; None for none.
        config: Of the table; its robot is taken for an arm.

    Raises:
        ConfigError: the arm or the table is wrong.
        FitError: the gripper's fingers are too thin.
    """
    settings = load_config(config, {"robot.kind": "arm"})
    setup = arm_setup(settings)
    if picture is not None:
        require_writable(picture)
    if setup is None:  # it has just been chosen
        return
    table = settings.build_table()
    angles = sorted({radians(tilt) for tilt in tilts})
    margins = list(grasp_margins(table, setup.arm, tuple(angles)))
    Console().print(_rows(margins))
    missing = [f"{degrees(angle):g}°" for angle in angles if angle not in {one.tilt for one in margins}]
    if missing:
        typer.echo(f"The arm does not reach d4 tilted by {', '.join(missing)}.")
    if picture is not None:
        picture.write_text(_drawn(margins))
        typer.echo(f"Drawn: {picture}")


def _rows(margins: Sequence[Margin]) -> Rows:
    rows = Rows(title="What error a grasp forgives, mm")
    for name in ("Piece", "Tilt", "Across", "Inwards", "Outwards", "Least"):
        rows.add_column(name, justify="left" if name == "Piece" else "right")
    for one in margins:
        sizes = (one.across, one.inwards, one.outwards, one.least)
        rows.add_row(
            chess.piece_name(one.kind), f"{degrees(one.tilt):g}°", *(f"{size:.1f}" for size in sizes)
        )
    return rows


def _drawn(margins: Sequence[Margin]) -> str:
    charts = [_chart(kind, [one for one in margins if one.kind == kind]) for kind in KINDS]
    return draw_charts([chart for chart in charts if chart.x], "What error a grasp forgives", "mm")


def _chart(kind: chess.PieceType, margins: Sequence[Margin]) -> Chart:
    lines = {name: [getattr(one, name) for one in margins] for name in ("across", "inwards", "outwards")}
    return Chart(chess.piece_name(kind), "tilt, degrees", [degrees(one.tilt) for one in margins], lines)
