from goalreach_lab.reproduction.blend_study import blend_study
from goalreach_lab.study import find


def test_the_printed_equation_deviates_and_products_do_not_jump() -> None:
    found = find(blend_study(starts=40, seed=1, jobs=1))
    assert found['fuzzy']['goal'] == 40
    assert found['fuzzy']['jump_deg'] < 0.01
    assert found['fuzzy-eq3']['jump_deg'] > 10.0
    assert found['fuzzy-as-printed']['deviation']['worst_deg'] > 45.0
