"""What leaves the region around the lip flies on as a stone that has never been in it."""

import numpy as np
import pytest
from bolfi_liquids.models import runtime
from bolfi_liquids.models.pours.flights import Flights
from bolfi_liquids.models.pours.vessel import turned

GRAVITY = np.array([0.0, 0.0, -9.81])
PLACE, VELOCITY = np.array([0.01, 0.004, -0.03]), np.array([0.4, 0.1, 0.5])  # as it leaves
DT, STEP = 0.003, 60  # [s], and that at the end of which it leaves
RATES = np.radians([0.0, 90.0, 180.0, 180.0])  # of the lanes' cups
TURNING = np.array([0, 80, 80, 50])  # steps for which they turn; the last has stopped


@pytest.fixture(scope="module")
def stones():
    """Gives a scene of one particle a lane, whose `throw` a test calls."""
    runtime.start()
    import taichi as ti
    from bolfi_liquids.models.apic.lanes import LANES
    from bolfi_liquids.models.pours.scene import PouringScene

    @ti.data_oriented
    class Stones(PouringScene):
        @ti.kernel
        def throw(self, step: ti.i32):
            """Let each lane's particle fly at the end of a step."""
            for _ in range(1):
                self.begin_step(0, step)
                for lane in range(LANES):
                    self.fly(0, lane, 0, step)

    return Stones(1, 1, 1)


def stone(since):
    """Place [m] and velocity [m/s] in the room, so long after it left [s]."""
    return PLACE + VELOCITY * since + 0.5 * GRAVITY * since**2, VELOCITY + GRAVITY * since


def in_cup(lane, since):
    """The same in a lane's cup."""
    turned_for = RATES[lane] * min((STEP + 1) * DT + since, TURNING[lane] * DT)
    turn = RATES[lane] if TURNING[lane] > STEP else 0.0
    place, velocity = turned(np.array(stone(since)), -turned_for)
    return place, velocity - turn * np.array([place[2], 0.0, -place[0]])


def test_what_leaves_a_cup_goes_on_along_its_parabola(stones):
    """From cups that stand, turn, and have stopped.

    Half a step of gravity is 15 mm/s, and the turn's speed there 50 mm/s and more.
    """
    stones.dt[None] = DT
    lanes = len(RATES)
    turns = np.stack([RATES, RATES * DT * TURNING]).astype(np.float32)
    steps = np.stack([TURNING, np.full(lanes, 100)]).astype(np.int32)
    stones.turn(turns[:, None], steps[:, None])
    for lane in range(lanes):
        stones.position[0, lane, 0] = in_cup(lane, 0.0)[0]
        stones.speed[0, lane, 0] = in_cup(lane, -0.5 * DT)[1]  # that of the step's middle
    stones.throw(STEP)
    found = stones.flight.to_numpy()[0, :, 0].astype(float)
    departure = stones.departure.to_numpy()[0, :, 0].astype(float)
    np.testing.assert_allclose(departure, (STEP + 1) * DT, rtol=1e-6)
    np.testing.assert_allclose(found[:, :3], np.tile(PLACE, (lanes, 1)), rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found[:, 3:], np.tile(VELOCITY, (lanes, 1)), rtol=0.0, atol=2e-4)
    flights = Flights(found[:, :3], found[:, 3:], departure, 0.0, lanes)
    later = np.tile(stone(0.1)[0], (lanes, 1))
    np.testing.assert_allclose(flights.at(np.full(lanes, 0.1)), later, rtol=0.0, atol=3e-5)
