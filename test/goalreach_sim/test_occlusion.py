import pytest

from goalreach_sim.camera_view import is_hidden, posts_from_flat

CAMERA_M = (0.0, 0.0, 1.0)


def test_posts_from_flat_numbers() -> None:
    assert posts_from_flat(()) == ()
    assert posts_from_flat((1.0, 2.0, 0.1, 1.5, 3.0, 4.0, 0.2, 2.5)) == (
        (1.0, 2.0, 0.1, 1.5),
        (3.0, 4.0, 0.2, 2.5),
    )


@pytest.mark.parametrize(
    ('post', 'hidden'),
    [
        ((2.0, 0.0, 0.1, 2.0), True),
        ((2.0, 0.09, 0.1, 2.0), True),
        ((2.0, 0.11, 0.1, 2.0), False),
        ((-2.0, 0.0, 0.1, 2.0), False),
        ((5.0, 0.0, 0.1, 2.0), False),
        # The line of sight rises 0.25 m per metre: 1.475 m high where it meets the post.
        ((2.0, 0.0, 0.1, 1.48), True),
        ((2.0, 0.0, 0.1, 1.47), False),
    ],
)
def test_post_by_hand(post: tuple[float, float, float, float], hidden: bool) -> None:  # noqa: FBT001 - a parameter of the test
    assert is_hidden(CAMERA_M, (4.0, 0.0, 2.0), [post]) is hidden


def test_an_led_straight_above_is_not_hidden() -> None:
    assert not is_hidden(CAMERA_M, (0.0, 0.0, 2.0), [(0.0, 0.0, 0.1, 3.0)])
