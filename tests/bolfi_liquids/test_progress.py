"""Progress that was made before is not counted again."""

import pytest

from bolfi_liquids.progress import after_first


@pytest.mark.parametrize(
    ("kept", "steps", "seen"),
    [(0, [1, 1, 2], [1, 1, 2]), (3, [1, 1, 2, 3], [1, 3]), (9, [4, 4], []), (2, [5], [3])],
)
def test_only_steps_after_the_first_ones_move_the_bar(kept, steps, seen):
    moved = []
    advance = after_first(kept, moved.append)
    for one in steps:
        advance(one)
    assert moved == seen
