from goalreach_lab.localization.ros_input_study import input_study
from goalreach_lab.study import find


def test_invalid_inputs_make_no_good_pose_and_one_reason() -> None:
    study = input_study(seed=0)
    rows = study.rows(find(study))
    assert [row.met for row in rows[:2]] == [True, True]
    assert rows[0].n == 25
