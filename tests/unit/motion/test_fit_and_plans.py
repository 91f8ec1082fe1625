import chess
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kempelen.core.fit import check_fit
from kempelen.core.geometry import Transform
from kempelen.core.pieces import KINDS, PRESETS
from kempelen.core.places import Place, Transfer
from kempelen.core.table import Gripper, Table, Tray, WorkSpace, start_layout
from kempelen.motion.plan import plan_approach, plan_carry
from kempelen.motion.scene import Scene

PLACES = ("a1", "b1", "d1", "e2", "c7", "h8")


@given(
    preset=st.sampled_from(sorted(PRESETS)),
    spare=st.floats(6.0, 9.0),
    shank=st.floats(2.0, 4.0),
    width=st.floats(12.0, 20.0),
    square=st.floats(0.9, 1.2),
    angle=st.sampled_from([0.0, 0.1, -0.25]),
)
def test_what_fits_can_be_gripped_and_carried(
    preset: str, spare: float, shank: float, width: float, square: float, angle: float
) -> None:
    pieces = PRESETS[preset]
    opening = max(pieces[kind].head_diameter for kind in KINDS) + spare
    side = square * (36.0 if preset == "small" else 50.0)
    table = Table(
        robot_from_board=Transform.about_z(angle, (190.0, 60.0, 0.0)),
        square=side,
        trays=(Tray(name="left", origin=(-1.8 * side, side / 2), pitch=side),
               Tray(name="right", origin=(8.8 * side, side / 2), pitch=side)),
        pieces=pieces,
        gripper=Gripper(opening=opening, finger_thickness=0.21 * opening + shank, finger_width=width),
        space=WorkSpace(lower=(-200.0, -200.0, 0.0), upper=(1000.0, 800.0, 220.0)),
    )  # fmt: skip
    assume(not check_fit(table))
    layout = start_layout(table, chess.Board())
    scene = Scene(table, layout)
    for place in map(Place, PLACES):
        approach = plan_approach(scene, table.park_point(table.centre(place)), place)
        carry = plan_carry(scene, Transfer(layout[place], place, Place("e4")))
        assert approach.vertices[-1] == pytest.approx(carry.vertices[0])
