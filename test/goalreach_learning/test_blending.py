from collections.abc import Callable
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from goalreach_learning.blending import MODES, blend_heading, votes
from goalreach_learning.policy import Policy
from goalreach_msgs_py.angles import angle_difference
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.regions import memberships

PolicyMaker = Callable[[dict[tuple[int, int], int]], Policy]
LEFT, HALF = (1.0, 0.0, 0.0), (0.5, 0.5, 0.0)
FAR = (0.0, 0.0, 1.0)


def heading_deg(mode: str, mu_x: tuple[float, ...], mu_y: tuple[float, ...], p: Policy) -> float:
    heading = blend_heading(mode, mu_x, mu_y, p)
    assert heading is not None
    return math.degrees(heading)


@pytest.mark.parametrize('mode', MODES)
def test_inside_a_cell_its_action_is_driven(mode: str, make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 2): 7})
    assert heading_deg(mode, LEFT, FAR, policy) == pytest.approx(-45.0)


def test_unit_vectors_of_315_and_45_give_0_but_numbers_give_180(make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 2): 7, (1, 2): 1})
    assert heading_deg('fuzzy', HALF, FAR, policy) == pytest.approx(0.0, abs=1e-9)
    # equation (3): columns 0 and 1 with 1/2 each, and the dominant one with mu_y = 1 again
    assert votes('fuzzy-eq3', HALF, FAR, policy)[2].region == (1, 2)
    mean_deg = (0.5 * 315 + 0.5 * 45 + 1.0 * 45) / 2.0
    assert mean_deg == 112.5  # out of the sector that both point to
    assert heading_deg('fuzzy-as-printed', HALF, FAR, policy) == pytest.approx(112.5)
    y = (0.5 + 1.0 - 0.5) * math.sin(math.pi / 4)
    x = 2.0 * math.cos(math.pi / 4)
    expected = math.degrees(math.atan2(y, x))
    assert heading_deg('fuzzy-eq3', HALF, FAR, policy) == pytest.approx(expected)


def test_products_weigh_four_cells(make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 1): 0, (1, 1): 2, (0, 2): 4, (1, 2): 6})
    cast = votes('fuzzy', (0.25, 0.75, 0.0), (0.0, 0.4, 0.6), policy)
    assert {v.region: v.weight for v in cast} == pytest.approx(
        {(0, 1): 0.1, (1, 1): 0.3, (0, 2): 0.15, (1, 2): 0.45}
    )


@pytest.mark.parametrize('mode', MODES)
def test_goal_and_unlearned_cells_do_not_vote(mode: str, make_policy: PolicyMaker) -> None:
    policy = make_policy({(1, 0): 4, (0, 0): 0})  # an entry for the goal is not an action
    assert heading_deg(mode, (0.2, 0.8, 0.0), LEFT, policy) == pytest.approx(0.0)
    assert votes(mode, (0.0, 1.0, 0.0), LEFT, policy) == ()
    assert blend_heading(mode, (0.0, 1.0, 0.0), LEFT, policy) is None


def test_votes_that_cancel_out_give_no_heading(make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 2): 0, (1, 2): 4})
    assert blend_heading('fuzzy', HALF, FAR, policy) is None


def test_crisp_asks_the_dominant_cell(make_policy: PolicyMaker) -> None:
    policy = make_policy({(0, 2): 0, (1, 2): 6})
    assert heading_deg('crisp', (0.4, 0.6, 0.0), FAR, policy) == pytest.approx(-90.0)


def test_refuses_an_unknown_mode(make_policy: PolicyMaker) -> None:
    with pytest.raises(ConfigurationError, match=r'mode = .blurred.: must be one of crisp'):
        votes('blurred', LEFT, FAR, make_policy({}))


@given(st.floats(0.0, 3.556), st.floats(0.0, 5.08), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_default_blend_is_continuous(
    learned: Policy, x: float, y: float, dx: float, dy: float
) -> None:
    regions = learned.regions
    step_m = 1e-3

    def at(px: float, py: float) -> float | None:
        return blend_heading(
            'fuzzy',
            memberships(px, regions.x_knots_m),
            memberships(py, regions.y_knots_m),
            learned,
        )

    before, after = at(x, y), at(x + step_m * dx, y + step_m * dy)
    if before is not None and after is not None:
        assert abs(angle_difference(after, before)) < math.radians(2.0)
