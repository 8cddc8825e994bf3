"""Skills of one arm."""

from wbc_suite.experts.skills import STALLED, move


class FakeArm:
    """A hand whose distance to its target follows a list, m."""

    def __init__(self, distances, *, coupled):
        self.left, self.coupled = iter(distances), coupled

    def aim(self, *args, **options):
        pass

    def error(self):
        return next(self.left), 0.0


def outcome(distances, *, coupled=False):
    steps = move(FakeArm(distances, coupled=coupled), None)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def test_a_hand_that_is_pushed_off_its_way_returns_and_does_not_give_up():
    """It was nearer before; the way back takes longer than `STALLED`."""
    back = [0.1 - 0.005 * k for k in range(21)]
    assert len(back) > STALLED
    pushed = [0.02, 0.006, 0.03, 0.06, *back]
    assert outcome(pushed)
    assert outcome(pushed, coupled=True) is False


def test_a_hand_without_progress_gives_up():
    assert outcome([0.02] * (STALLED + 2)) is False
    assert outcome([0.02, 0.021] * STALLED) is False
