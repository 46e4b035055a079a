# type: ignore  (Taichi compiles this source and gives these names their types)
"""Groups of pours from cups of one shape."""

import numpy as np
import taichi as ti

from ..apic.filling import OFF_WALL
from ..apic.geometry import ABOVE, INSIDE, OUTSIDE
from ..apic.gravity import GRAVITY
from ..apic.lanes import LANES, vec3
from ..apic.transfer import CELLS, fault_of, mark_cell, motion_of, place_after
from ..apic.wetting_liquid import WettingLiquid
from ..faults import SOUND
from .flights import Flights

LEFT_OVER = 5e-4  # of the liquid: a pour is over when less than this is in the region
ON_WALL = 1e-4  # m beyond the inside of the cup that still counts as retained


@ti.data_oriented
class PouringScene(WettingLiquid):
    """Half of each cup, in its own frame, which turns about the lip; `Vessel` says how it lies.

    Turning changes gravity and adds centrifugal and Coriolis forces; where it starts or stops, what
    is at rest in the room jumps in this frame. Particles that leave the region fly freely.

    Attributes:
        rate_of_turn: Of each lane, while it turns [rad/s].
        turning: Steps for which it turns.
        last: Step before which it ends.
        flown: Particles that have left the region.
        flight: Of these in the room's frame where they left: place [m], velocity [m/s].
        departure: When they did [s].
        retained: Particles left in the cup at the end.
        shown: Particles of the first pour at its start, of which a fault leaves none.
    """

    SIDED, MIRRORED = True, True

    def __init__(self, groups, cells, particles, effects=()):
        """The arguments are those of `LiquidState`."""
        super().__init__(groups, cells, particles, effects)
        self.side = ti.Vector.field(4, ti.f32, (CELLS + 1, cells))
        self.rate_of_turn, self.final_angle = (ti.field(ti.f32, (groups, LANES)) for _ in range(2))
        self.turning, self.last, self.flown, self.retained = (
            ti.field(ti.i32, (groups, LANES)) for _ in range(4)
        )
        # of the step at hand: angle of the cup, rate of turn, its jump, angle of Coriolis
        self.frame = ti.Vector.field(6, ti.f32, (groups, LANES))
        self.flight = ti.Vector.field(6, ti.f32, (groups, LANES, particles))
        self.departure = ti.field(ti.f32, (groups, LANES, particles))
        self.radius, self.height, self.rim, self.under = (ti.field(ti.f32, ()) for _ in range(4))
        self.lowest, self.highest = (ti.Vector.field(3, ti.f32, ()) for _ in range(2))

    def enter_cup(self, vessel, rim, dt):
        """Take a `Vessel`, the thickness of its rim [m] and a step [s]."""
        grid, geometry = vessel.grid(), vessel.geometry()
        self.enter_vessel(grid, geometry, dt)
        self.radius[None], self.height[None] = vessel.radius, vessel.height
        self.rim[None], self.under[None] = rim, vessel.under
        lows, highs = zip(*vessel.corners, strict=True)
        self.lowest[None], self.highest[None] = lows, highs
        self.enter_surfaces(geometry.usable, np.stack([geometry.wall, geometry.area]))
        sides = np.zeros((CELLS + 1, self.cells, 4), np.float32)
        for c, o in enumerate((0, 1, grid.strides[1], 1 + grid.strides[1])):
            sides[:CELLS, : grid.cells, c] = np.roll(geometry.face_side, -o, 1)
            sides[CELLS, : grid.cells, c] = np.roll(geometry.side, -o)
        self.side.from_numpy(sides)

    @ti.kernel
    def turn(self, turns: ti.types.ndarray(ti.f32, 3), steps: ti.types.ndarray(ti.i32, 3)):
        """Begin a pour.

        Args:
            turns: Rate of turn [rad/s] and final angle [rad], shape [2, groups, LANES].
            steps: For which the cup turns, and before which the pour ends, [2, groups, LANES].
        """
        for g in range(turns.shape[1]):
            for lane in range(LANES):
                self.rate_of_turn[g, lane] = turns[0, g, lane]
                self.final_angle[g, lane] = turns[1, g, lane]
                self.turning[g, lane] = steps[0, g, lane]
                self.last[g, lane] = steps[1, g, lane]
                self.flown[g, lane], self.retained[g, lane] = 0, 0

    @ti.func
    def begin_step(self, g, step):
        for lane in range(LANES):
            self.find_frame(g, lane, step)

    @ti.func
    def find_frame(self, g, lane, step):
        """Angle of the cup, and how fast it turns, in a step."""
        turn, dt = self.rate_of_turn[g, lane], self.dt[None]
        now = ti.select(step < self.turning[g, lane], turn, 0.0)
        before = ti.select(step > 0 and step <= self.turning[g, lane], turn, 0.0)
        angle = self.angle_after(g, lane, step)
        twice = 2.0 * now * dt
        self.frame[g, lane] = ti.Vector(
            [ti.cos(angle), ti.sin(angle), now, before - now, ti.cos(twice), ti.sin(twice)]
        )

    @ti.func
    def angle_after(self, g, lane, steps):
        """Angle by which the cup has turned after so many steps."""
        turned = self.rate_of_turn[g, lane] * steps * self.dt[None]
        return ti.min(turned, self.final_angle[g, lane])

    @ti.func
    def in_room(self, g, lane, steps, v):
        """A vector of the cup's frame in the room's, so many steps after the start."""
        angle = self.angle_after(g, lane, steps)
        c, s = ti.cos(angle), ti.sin(angle)
        return vec3(c * v[0] + s * v[2], v[1], c * v[2] - s * v[0])

    @ti.func
    def accelerate(self, g, lane, n):
        """Gravity and the forces of the turning frame, half before and half after Coriolis'."""
        cosine, sine, turn, jump, whirl, swirl = self.frame[g, lane]
        dt, dx = self.dt[None], self.cell[None]
        x, v, slope = self.position[g, lane, n], self.speed[g, lane, n], self.slope[g, lane, n]
        pull_x = sine * GRAVITY + turn * turn * x[0]
        pull_z = turn * turn * x[2] - cosine * GRAVITY
        half_x, half_z = 0.5 * dt * pull_x, 0.5 * dt * pull_z
        along, up = v[0] + half_x, v[2] + half_z
        self.speed[g, lane, n] = vec3(
            whirl * along - swirl * up + half_x + jump * x[2],
            v[1],
            swirl * along + whirl * up + half_z - jump * x[0],
        )
        for b in ti.static(range(3)):
            along, up = slope[0, b], slope[2, b]
            slope[0, b] = whirl * along - swirl * up
            slope[2, b] = swirl * along + whirl * up
        slope[0, 0] += dt * turn * turn * dx
        slope[2, 2] += dt * turn * turn * dx
        slope[0, 2] += jump * dx
        slope[2, 0] -= jump * dx
        self.slope[g, lane, n] = slope

    @ti.func
    def out(self, x):
        """Distance of a point from the cup's axis."""
        return ti.sqrt((x[0] + self.radius[None]) ** 2 + x[1] ** 2)

    @ti.func
    def side_of(self, x):
        side = ti.cast(ABOVE, ti.f32)
        if x[2] <= 0.0:
            within = self.out(x) < self.radius[None] + 0.5 * self.rim[None]
            side = ti.select(within, ti.cast(INSIDE, ti.f32), ti.cast(OUTSIDE, ti.f32))
        return side

    @ti.func
    def keep_off_wall(self, before, after, velocity):
        """Position and velocity of a particle that the walls stop."""
        x, v = after, velocity
        off = OFF_WALL * self.cell[None]
        inner, outer = self.radius[None], self.radius[None] + self.rim[None]
        if x[1] < 0.0:  # its image comes the other way
            x[1], v[1] = -x[1], -v[1]
        out = self.out(x)
        if x[2] < off and out > inner - off and out < outer + off:
            was = self.out(before)
            if before[2] >= 0.99 * off and out > inner and out < outer:
                x[2], v[2] = off, ti.max(v[2], 0.0)
            else:
                within = was < inner + 0.5 * self.rim[None]
                if before[2] >= 0.0 and out >= outer:
                    within = False
                to = ti.select(within, inner - off, outer + off)
                n = vec3(x[0] + inner, x[1], 0.0) / out
                x += (to - out) * n
                into = v.dot(n)
                if (into > 0.0) == within:
                    v -= into * n
        if x[2] < off - self.height[None] and self.out(x) < outer:
            x[2], v[2] = off - self.height[None], ti.max(v[2], 0.0)
        return x, v

    @ti.func
    def has_left(self, x):
        """Whether a particle is beyond the region."""
        aside = x[0] < self.lowest[None][0] or x[0] > self.highest[None][0]
        aside = aside or x[1] > self.highest[None][1] or x[2] > self.highest[None][2]
        under = x[2] < -self.under[None] and self.side_of(x) == OUTSIDE
        return aside or under

    @ti.func
    def fly(self, g, lane, n, step):
        """Let a particle fly freely from where it is at the end of a step.

        Its velocity is that of the step's middle, so gravity acts for half a step more.
        """
        dt, turn = self.dt[None], self.frame[g, lane][2]
        x, v = self.position[g, lane, n], self.speed[g, lane, n]
        x_middle = x - 0.5 * dt * v
        v += turn * vec3(x_middle[2], 0.0, -x_middle[0])
        place = self.in_room(g, lane, step + 1.0, x)
        velocity = self.in_room(g, lane, step + 0.5, v) - vec3(0.0, 0.0, 0.5 * dt * GRAVITY)
        k = self.flown[g, lane]
        for a in ti.static(range(3)):
            self.flight[g, lane, k][a] = place[a]
            self.flight[g, lane, k][3 + a] = velocity[a]
        self.departure[g, lane, k] = (step + 1) * self.dt[None]
        self.flown[g, lane] = k + 1

    @ti.func
    def move_on(self, g, lane, step):
        """Move the particles; those that leave fly on, and the last takes the place of each."""
        n, last, energy, fastest = 0, self.count[g, lane], 0.0, 0.0
        while n < last:
            v, slope = motion_of(self, g, lane, n)
            before = self.position[g, lane, n]
            after = place_after(self, before, v, slope)
            after, v = self.keep_off_wall(before, after, v)
            self.position[g, lane, n], self.speed[g, lane, n] = after, v
            self.slope[g, lane, n] = slope
            energy += v.dot(v)
            fastest = ti.max(fastest, v.dot(v))
            if self.has_left(after):
                self.fly(g, lane, n, step)
                last -= 1
                self.position[g, lane, n] = self.position[g, lane, last]
                self.speed[g, lane, n] = self.speed[g, lane, last]
                self.slope[g, lane, n] = self.slope[g, lane, last]
            else:
                mark_cell(self, g, after)
                n += 1
        self.count[g, lane] = last
        self.status[g, lane] = fault_of(self, g, lane, energy, fastest)
        if self.status[g, lane] != SOUND:
            self.count[g, lane] = 0

    @ti.func
    def end(self, g, lane, step):
        """Let what is outside of the cup at the end fly on; the rest comes first."""
        for n in range(self.count[g, lane]):
            x = self.position[g, lane, n]
            if x[2] < 0.0 and self.out(x) < self.radius[None] + ON_WALL:
                self.position[g, lane, self.retained[g, lane]] = x
                self.retained[g, lane] += 1
            else:
                self.fly(g, lane, n, step)
        self.count[g, lane] = 0

    @ti.func
    def transfer_out(self, g, step):
        for lane in range(LANES):
            if self.count[g, lane] > 0:
                all_of_it = self.count[g, lane] + self.flown[g, lane]
                self.move_on(g, lane, step)
                few = self.count[g, lane] < LEFT_OVER * all_of_it
                if few or step + 1 >= self.last[g, lane]:
                    self.end(g, lane, step)

    def view(self):
        """The first pour: places of its particles in the cup's frame [m], shape [n, 3], and its
        `Flights` so far."""
        held = max(self.count[0, 0], self.retained[0, 0])
        flown = self.flown[0, 0]
        flight = self.flight.to_numpy()[0, 0, :flown]
        flights = Flights(
            flight[:, :3], flight[:, 3:], self.departure.to_numpy()[0, 0, :flown], 0.0, self.shown
        )
        return self.position.to_numpy()[0, 0, :held], flights
