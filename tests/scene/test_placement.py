import itertools
import math

import numpy as np
import pytest
from pydantic import ValidationError

from wbc_suite.errors import PlacementError
from wbc_suite.scene.objects import Extent
from wbc_suite.scene.placement import (
    OnTopSampler,
    Region,
    RejectionSampler,
    SequentialSampler,
    UniformSampler,
)


class Measured:
    def __init__(self, radius, height):
        self._extent = Extent(radius=radius, bottom=height / 2, top=height / 2)

    def extent(self, quat=None):
        return self._extent


THINGS = {name: Measured(0.03 + 0.005 * k, 0.1) for k, name in enumerate("abcd")}
REGION = Region(x=(-0.15, 0.15), y=(-0.1, 0.1), inside=True, gap=0.005)


def sampler(**changes):
    given = {"names": list("abcd"), "region": REGION, "origin": (1.0, 2.0, 0.8)}
    return UniformSampler(**(given | changes))


def test_things_stay_inside_apart_and_on_the_surface():
    for seed in range(100):
        placed = sampler().sample(np.random.default_rng(seed), THINGS, {})
        for name, place in placed.items():
            x, y, z = place.position
            radius = THINGS[name].extent().radius
            assert abs(x - 1.0) <= 0.15 - radius
            assert abs(y - 2.0) <= 0.10 - radius
            assert z == pytest.approx(0.85)
        for a, b in itertools.combinations(placed.values(), 2):
            apart = math.dist(a.position[:2], b.position[:2])
            assert apart >= a.extent.radius + b.extent.radius + 0.005


def test_the_generator_alone_decides():
    first, again, other = (
        sampler().sample(np.random.default_rng(s), THINGS, {}) for s in (1, 1, 2)
    )
    assert first == again != other


def test_yaw_stays_in_its_range_and_keeps_the_rest_pose():
    half = math.sqrt(0.5)
    region = Region(x=(0, 0), y=(0, 0), yaw=(0.3, 0.3))
    lying = UniformSampler(names=["a"], region=region, rest=(half, half, 0.0, 0.0))
    quat = lying.sample(np.random.default_rng(0), THINGS, {})["a"].quat
    turn = np.array([math.cos(0.15), 0, 0, math.sin(0.15)])
    wanted = half * np.array([turn[0], turn[0], turn[3], turn[3]])
    np.testing.assert_allclose(quat, wanted, atol=1e-15)


def test_no_room_says_what_to_relax():
    small = Region(x=(-0.05, 0.05), y=(-0.05, 0.05), inside=True)
    with pytest.raises(PlacementError) as caught:
        sampler(region=small).sample(np.random.default_rng(0), THINGS, {})
    text = str(caught.value)
    assert "'b' of radius 0.035 m" in text
    assert "beside a (0.030)" in text
    assert "Enlarge the region" in text
    assert "inside = false" in text


def test_a_region_smaller_than_the_thing_is_no_room():
    small = Region(x=(0, 0.01), y=(0, 0.01), inside=True)
    with pytest.raises(PlacementError, match="of radius 0\\.030 m"):
        sampler(region=small).sample(np.random.default_rng(0), THINGS, {})


def test_what_stands_on_a_thing_may_be_above_it_and_moves_with_it():
    on_a = OnTopSampler(
        names=["b"], support="a", region=Region(x=(-0.01, 0.01), y=(0, 0))
    )
    both = SequentialSampler(samplers=[sampler(names=["a"]), on_a])
    for seed in range(20):
        placed = both.sample(np.random.default_rng(seed), THINGS, {})
        a, b = placed["a"].position, placed["b"].position
        assert b[2] - a[2] == pytest.approx(0.1)
        assert abs(b[0] - a[0]) <= 0.01
        assert b[1] == a[1]


def test_nothing_stands_on_what_has_no_place():
    on_a = OnTopSampler(names=["b"], support="a", region=REGION)
    with pytest.raises(PlacementError, match="'a' must be placed before"):
        on_a.sample(np.random.default_rng(0), THINGS, {})


def test_a_picky_sampler_draws_until_places_will_do():
    def right(placed):
        return placed["a"].position[0] > REGION.x[1] / 2

    picky = RejectionSampler(
        sampler=sampler(names=["a"]), accepts=right, wanted="a is on the right"
    )
    for seed in range(20):
        assert right(picky.sample(np.random.default_rng(seed), THINGS, {}))
    never = RejectionSampler(
        sampler=sampler(names=["a"]), accepts=lambda _: False, wanted="a is nowhere"
    )
    with pytest.raises(PlacementError, match="no place for a where a is nowhere"):
        never.sample(np.random.default_rng(0), THINGS, {})


def test_regions_have_their_ends_in_order():
    with pytest.raises(ValidationError, match="lower end must come first"):
        Region(x=(0.1, -0.1), y=(0, 0))
