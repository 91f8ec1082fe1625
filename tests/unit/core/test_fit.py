from math import pi, radians

import chess
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempelen.core.errors import FitError
from kempelen.core.fit import DRIVING, OFF_CENTRE, PIECES_OFF_BOARD, Finding, check_fit, refuse
from kempelen.core.geometry import Transform
from kempelen.core.pieces import KINDS, PRESETS, PieceSet
from kempelen.core.places import Place
from kempelen.core.table import Gripper, Table, Tray, WorkSpace

TRAYS = (
    Tray(name="left", origin=(-90.0, 25.0), pitch=50.0),
    Tray(name="right", origin=(440.0, 25.0), pitch=50.0),
)


def hand(**changes: float) -> Gripper:
    sizes = {"opening": 32.0, "finger_thickness": 4.0, "finger_width": 14.0, "below_tool": 7.0}
    sizes |= {"finger_length": 95.0, "palm_radius": 35.0, "release_height": 0.8}
    return Gripper.model_validate(sizes | changes)


def table_with(**changes: object) -> Table:
    """A table on which all fits, changed; it does not follow the defaults."""
    parts: dict[str, object] = {
        "robot_from_board": Transform.about_z(0.0, (150.0, 25.0, 0.0)),
        "square": 50.0,
        "trays": TRAYS,
        "pieces": PRESETS["club"],
        "gripper": hand(),
        "space": WorkSpace(lower=(0.0, 0.0, 0.0), upper=(700.0, 450.0, 200.0)),
    }
    return Table(**(parts | changes))  # type: ignore[arg-type]


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, [str(finding) for finding in findings]
    return findings[0]


def starting(findings: list[Finding], words: str) -> list[Finding]:
    return [finding for finding in findings if finding.what.startswith(words)]


def club(kind: chess.PieceType, **changes: float) -> PieceSet:
    shapes = {chess.piece_name(k): PRESETS["club"][k] for k in KINDS}
    name = chess.piece_name(kind)
    shapes[name] = shapes[name].model_copy(update=changes)
    return PieceSet(name="changed", **shapes)


def test_the_default_table_fits() -> None:
    assert check_fit(Table()) == []
    refuse(check_fit(Table()))


def test_the_thesis_set_fits_the_default_table() -> None:
    assert check_fit(Table(pieces=PRESETS["thesis"])) == []


def test_the_small_set_fits_35_mm_squares_with_a_smaller_gripper() -> None:
    small = table_with(
        robot_from_board=Transform.about_z(0.0, (200.0, 60.0, 0.0)),
        square=35.0,
        pieces=PRESETS["small"],
        gripper=hand(opening=24.0),
        trays=(
            Tray(name="left", origin=(-90.0, 5.0), pitch=38.0),
            Tray(name="right", origin=(330.0, 5.0), pitch=38.0),
        ),
    )
    assert check_fit(small) == []


def test_a_board_beyond_the_work_space_is_named_with_its_place_axis_and_excess() -> None:
    shifted = table_with(robot_from_board=Transform.about_z(0.0, (150.0, 80.0, 0.0)))
    findings = check_fit(shifted)
    assert [finding.by for finding in findings] == pytest.approx([5.0, 5.0, 5.0])
    assert {finding.what.split(":")[0] for finding in findings} == {
        "Reach of the board",
        "Reach of the left",
        "Reach of the right",
    }
    board = only(starting(findings, "Reach of the board"))
    assert board.what.endswith("8 the tool point has y 455.0 mm, the work space is 0.0 to 450.0 mm")
    assert board.mend.startswith("Move the board 5.0 mm in -y")


@given(x=st.floats(-60, 60), y=st.floats(-60, 60), angle=st.floats(-0.2, 0.2))
def test_reach_is_complained_of_exactly_when_a_place_lies_outside(x: float, y: float, angle: float) -> None:
    table = table_with(robot_from_board=Transform.about_z(angle, (150.0 + x, 25.0 + y, 0.0)))
    outside = max(
        table.space.excess(table.grip_point(place, kind)) for place in table.places for kind in KINDS
    )
    reach = starting(check_fit(table), "Reach")
    assert max((finding.by for finding in reach), default=0.0) == pytest.approx(outside, abs=1e-5)


def test_a_tray_below_the_reach_is_named() -> None:
    deep = (TRAYS[0].model_copy(update={"height": -40.0}), TRAYS[1])
    reach = only(starting(check_fit(table_with(trays=deep)), "Reach"))
    assert "left" in reach.what
    assert "z -16.0 mm" in reach.what
    assert reach.by == pytest.approx(16.0)


def test_a_low_gantry_cannot_carry_over_the_tallest_piece() -> None:
    finding = only(check_fit(table_with(space=WorkSpace(upper=(700.0, 450.0, 140.0)))))
    # 95 mm of king below, 10 mm of air, and the carried king's grip 48 mm above its base.
    assert "z 153.0 mm" in finding.what
    assert finding.by == pytest.approx(13.0)
    assert str(finding).startswith("Lift: ")
    assert ": 13.0 mm too much. Raise" in str(finding)


def test_long_finger_tips_touch_the_surface() -> None:
    finding = only(check_fit(table_with(gripper=hand(below_tool=25.0))))
    assert "a pawn is gripped 24.0 mm above" in finding.what
    assert finding.by == pytest.approx(2.0)


def test_wide_bases_are_too_wide_for_squares_and_slots() -> None:
    wide = table_with(pieces=club(chess.QUEEN, base_diameter=48.0))
    spacing = [finding for finding in check_fit(wide) if "the widest piece needs 54.0 mm" in finding.what]
    assert [finding.what.split(" of ")[0] for finding in spacing] == [
        "Squares",
        "Tray 'left': slots",
        "Tray 'right': slots",
    ]
    assert all(finding.by == pytest.approx(4.0) for finding in spacing)


def test_a_single_slot_has_no_pitch_to_complain_of() -> None:
    single = table_with(trays=(*TRAYS, Tray(name="one", origin=(500.0, 25.0), rows=1, columns=1, pitch=15.0)))
    assert starting(check_fit(single), "Tray 'one': slots") == []


def test_a_tray_on_the_board_is_named_with_its_slot() -> None:
    inside = (TRAYS[0].model_copy(update={"origin": (-60.0, 25.0)}), TRAYS[1])
    finding = only(starting(check_fit(table_with(trays=inside)), "Tray 'left'"))
    assert "slot left9 is 10.0 mm from the playing field, its piece needs 22.0 mm" in finding.what
    assert finding.by == pytest.approx(12.0)


def test_trays_on_each_other_are_named() -> None:
    third = Tray(name="extra", origin=(-90.0, 45.0), rows=1, columns=1)
    finding = only(starting(check_fit(table_with(trays=(*TRAYS, third))), "Trays 'left' and 'extra'"))
    assert "slots left1 and extra1 are 20.0 mm apart" in finding.what
    assert finding.by == pytest.approx(24.0)


def test_every_piece_that_can_be_off_the_board_has_a_slot() -> None:
    """Regression: the original had no tray slot for all pieces and put the 27th capture on a1."""
    assert PIECES_OFF_BOARD == 32
    short = (TRAYS[0], TRAYS[1].model_copy(update={"rows": 5}))
    finding = only(check_fit(table_with(trays=short)))
    assert str(finding).endswith(
        "26 slots: 32 pieces can stand beside the board, the two spare queens included: 6 pieces "
        "too much. Add 6 slots."
    )


def test_no_trays_at_all_lack_all_slots() -> None:
    assert only(check_fit(table_with(trays=()))).by == PIECES_OFF_BOARD


def test_heads_pass_the_open_gripper_even_off_centre() -> None:
    table = table_with(pieces=club(chess.KNIGHT, head_diameter=30.0))
    finding = only(check_fit(table))
    assert "a knight up to 3 mm off-centre needs 36.9 mm" in finding.what
    assert finding.by == pytest.approx(30.0 + 2 * (OFF_CENTRE + DRIVING) - table.gripper.opening)


def test_fingers_between_neighbours() -> None:
    wide = hand(opening=44.0)  # outside of a finger at 26 mm: 24 mm from the neighbour, which needs 22.45
    assert check_fit(table_with(gripper=wide)) == []
    finding = only(check_fit(table_with(gripper=hand(opening=50.0))))
    assert "21.0 mm from the middle" in finding.what
    assert "close at 0°" in finding.what
    assert finding.by == pytest.approx(1.0 + DRIVING)


def test_the_closing_axis_matters_on_a_turned_board() -> None:
    def turned(angle: float) -> list[Finding]:
        pose = Transform.about_z(angle, (350.0, 300.0, 0.0))
        space = WorkSpace(lower=(-2000.0, -2000.0, 0.0), upper=(2000.0, 2000.0, 200.0))
        return check_fit(table_with(robot_from_board=pose, space=space, gripper=hand(opening=50.0)))

    assert turned(radians(45)) == []  # the fingers open towards the diagonal neighbours, 71 mm away
    assert only(turned(radians(90))).what.startswith("Fingers")


@given(
    angle=st.floats(-pi, pi),
    closing=st.floats(-pi, pi),
    opening=st.floats(30, 60),
    thickness=st.floats(1, 12),
    width=st.floats(3, 40),
)
def test_fingers_agree_with_sampled_fingers(
    angle: float, closing: float, opening: float, thickness: float, width: float
) -> None:
    gripper = hand(closing_axis=closing, opening=opening, finger_thickness=thickness, finger_width=width)
    table = table_with(
        robot_from_board=Transform.about_z(angle, (0.0, 0.0, 0.0)),
        space=WorkSpace(lower=(-2000.0, -2000.0, 0.0), upper=(2000.0, 2000.0, 200.0)),
        trays=(),
        gripper=gripper,
    )
    found = starting(check_fit(table), "Fingers")
    along, across = np.meshgrid(
        np.linspace(opening / 2, opening / 2 + thickness, 9), np.linspace(-width / 2, width / 2, 9)
    )
    finger = np.column_stack([along.ravel(), across.ravel()])
    c, s = np.cos(closing), np.sin(closing)
    solid = np.vstack([finger, -finger]) @ np.array([[c, s], [-s, c]]) + table.centre(Place("d4"))[:2]
    nearest = min(
        float(np.linalg.norm(solid - table.centre(place)[:2], axis=1).min())
        for place in table.places
        if place != Place("d4")
    )
    room = nearest - (38.0 / 2 + OFF_CENTRE + DRIVING)
    fineness = max(thickness, width) / 8
    if found:
        assert room - fineness <= -found[0].by <= room + fineness
    else:
        assert room > -1e-6


def test_a_short_hand_rests_its_palm_on_a_neighbour() -> None:
    findings = check_fit(table_with(gripper=hand(finger_length=70.0)))
    assert "above the tallest piece" in only(findings).what
    assert only(findings).by == pytest.approx(95.0 + 2.0 - (24.0 + 70.0))


def test_a_short_hand_rests_its_palm_on_the_gripped_piece_itself() -> None:
    own = starting(check_fit(table_with(gripper=hand(finger_length=40.0))), "Palm: gripping a ")
    assert [finding.what.split(",")[0] for finding in own] == [
        "Palm: gripping a king",
        "Palm: gripping a queen",
    ]
    assert [finding.by for finding in own] == pytest.approx([9.0, 3.0])


def test_a_raised_tray_brings_heads_nearer_to_the_palm() -> None:
    raised = (TRAYS[0].model_copy(update={"height": 30.0}), TRAYS[1])
    palm = only(starting(check_fit(table_with(trays=raised, gripper=hand(palm_radius=45.0))), "Palm"))
    assert "on left" in palm.what
    assert palm.by == pytest.approx(95.0 + 30.0 + 2.0 - (24.0 + 95.0))


def test_all_misfits_are_told_at_once() -> None:
    with pytest.raises(FitError) as caught:
        refuse(check_fit(table_with(gripper=hand(finger_length=70.0, below_tool=30.0))))
    lines = caught.value.message.splitlines()
    assert lines[0] == "2 things do not fit on the table:"
    assert [line[:10] for line in lines[1:]] == ["  - Finger", "  - Palm: "]
    with pytest.raises(FitError, match="One thing does not fit"):
        refuse(check_fit(table_with(gripper=hand(below_tool=30.0))))


@given(shrink=st.floats(0.0, 20.0))
def test_following_the_mend_makes_it_fit(shrink: float) -> None:
    trays = (TRAYS[0].model_copy(update={"origin": (-90.0 + shrink, 25.0)}), TRAYS[1])
    findings = starting(check_fit(table_with(trays=trays)), "Tray 'left'")
    by = findings[0].by if findings else 0.0
    mended = (TRAYS[0].model_copy(update={"origin": (-90.0 + shrink - by, 25.0)}), TRAYS[1])
    assert starting(check_fit(table_with(trays=mended)), "Tray 'left'") == []
