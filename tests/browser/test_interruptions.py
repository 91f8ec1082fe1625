"""What comes between: pauses, stops, deaths, another board."""

from playwright.sync_api import expect

from kempelen.testing.pages import BACK_RANK, Visitor

SLOWLY = 0.5  # so that there is time to press a button


def test_paused_with_a_piece_in_the_gripper_and_loaded_anew(operator: Visitor) -> None:
    operator.new_game(BACK_RANK)
    operator.must("speed", speed=SLOWLY)
    operator.drag("e2", "e8")
    operator.doing("carrying")
    operator.button("Pause").click()
    operator.status("Paused in mid-move, perhaps with a piece in the gripper")
    assert operator.topic("robot")["gripper"] == "closed"

    operator.page.reload()
    operator.status("Paused in mid-move, perhaps with a piece in the gripper")
    expect(operator.button("Finish this move")).to_be_visible()
    operator.must("speed", speed=0)
    operator.button("Go on").click()
    operator.played("Qe8", "Rxe8")
    operator.my_turn()


def test_the_emergency_stop_and_back_into_the_game(operator: Visitor) -> None:
    operator.new_game(BACK_RANK)
    operator.must("speed", speed=SLOWLY)
    operator.drag("e2", "e8")
    operator.doing("carrying")
    operator.stop()
    operator.fault("Emergency stop").get_by_role("button", name="Recover").click()
    operator.must("speed", speed=0)
    operator.fault("Emergency stop").get_by_role("button", name="Home the robot").click()
    operator.fault("Emergency stop").get_by_role("button", name="Go on with the game").click()
    operator.played("Qe8", "Rxe8")
    operator.my_turn()
    assert operator.topic("game")["number"] == 1
