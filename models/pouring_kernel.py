# type: ignore  (Taichi compiles this source and gives these names their types)
"""The pouring scene: a cup of liquid turns about its lip, a receiver stands below.

World frame: origin at the lip, x towards the receiver, z up. Cup frame: origin at the centre of
the cup's floor, z along its axis; it coincides with the world's directions before the turn.
"""

import taichi as ti

from .fluid.faults import SOUND
from .fluid.fluid import STRIDE, Fluid, vec3

INSIDE, ABOVE, OUTSIDE = 0, 1, 2  # of the source: within its walls, above its rim, past it


@ti.data_oriented
class PouringScene(Fluid):
    """Fluid, turning source cup and receiver of a batch of pours."""

    walls = 2

    def __init__(self, slots, particles, spacing, numerics, cups, effects=()):
        source = cups.source
        reach = (4.0 * source.radius**2 + source.height**2) ** 0.5
        drop = cups.pour.lip_height - cups.receiver.height
        side = source.radius + 2.0 * spacing
        ahead = cups.distance_range[1] + cups.receiver.radius
        extent = [(-reach, -side, -drop), (max(reach, ahead), side, reach)]
        super().__init__(slots, particles, spacing, numerics, extent)
        self.bring(effects)
        self.cup_radius, self.cup_height = source.radius, source.height
        self.rim = -drop  # of the receiver, below the lip
        self.margin = numerics.contact * spacing
        self.wall_friction = numerics.wall_friction
        self.final_angle = cups.pour.final_angle
        self.rate_of_turn, self.angle, self.turning = (ti.field(ti.f32, slots) for _ in range(3))
        self.region = ti.field(ti.i32, (slots, particles))
        self.carry(self.region, ti.field(ti.i32, (slots, particles)))
        self.landed, self.retained = (ti.field(ti.i32, slots) for _ in range(2))
        self.landing = ti.Vector.field(2, ti.f32, (slots, particles))

    @ti.func
    def to_cup(self, b, p):
        c, s = ti.cos(self.angle[b]), ti.sin(self.angle[b])
        return vec3(c * p.x - s * p.z + self.cup_radius, p.y, s * p.x + c * p.z + self.cup_height)

    @ti.func
    def turn(self, b, d):
        """A direction of the cup frame in the world."""
        c, s = ti.cos(self.angle[b]), ti.sin(self.angle[b])
        return vec3(c * d.x + s * d.z, d.y, c * d.z - s * d.x)

    @ti.func
    def to_world(self, b, q):
        return self.turn(b, q - vec3(self.cup_radius, 0.0, self.cup_height))

    @ti.func
    def walls_at(self, q):
        """Side and floor rows at a point of the cup frame; the side fades out at the rim."""
        reach = ti.sqrt(q.x * q.x + q.y * q.y)
        fade = ti.math.clamp((self.cup_height - q.z) / self.h + 0.5, 0.0, 1.0)
        side = fade * self.look_up(self.half_space, ti.abs(self.cup_radius - reach))
        floor = self.look_up(self.half_space, q.z)
        outward = vec3(q.x, q.y, 0.0) / ti.max(reach, 1e-6)
        return side, floor, outward

    @ti.func
    def boundary(self, b, i):
        """The cup is the moving body: it turns as it is told, whatever the liquid does."""
        density = 0.0
        self.wall[b, i] = vec3(0.0)
        self.body_wall[b, i] = vec3(0.0)
        grip, moving = ti.Matrix.zero(ti.f32, 3, 3), vec3(0.0)
        p = self.position[b, i]
        q = self.to_cup(b, p)
        side, floor, outward = self.walls_at(q)
        if self.region[b, i] == INSIDE:
            outward = self.turn(b, outward)
            up = self.turn(b, vec3(0.0, 0.0, 1.0))
            self.body_wall[b, i] = (floor[1] * up - side[1] * outward) / self.h
            density = side[0] + floor[0]
            moving = self.turning[b] * vec3(p.z, 0.0, -p.x)
            grip = self.wall_grip(side, outward) + self.wall_grip(floor, up)
        elif q.z > 0.0 and side[3] > 0.0:
            # what runs over the rim still drags along the wall's edge and outer face
            moving = self.turning[b] * vec3(p.z, 0.0, -p.x)
            slip = ti.min(1.0, self.numerics.outer_viscosity / self.kinematic(b))
            rub = self.wall_rub(side, self.turn(b, outward))
            grip = self.numerics.outer_wall * slip * rub
        self.grip_walls(b, i, grip, moving)
        return density

    @ti.func
    def wall_near(self, b, i, n: ti.template()):
        q = self.to_cup(b, self.position[b, i])
        distance, normal, share = q.z, vec3(0.0, 0.0, 1.0), 1.0
        if ti.static(n == 1):
            reach = ti.max(ti.sqrt(q.x * q.x + q.y * q.y), 1e-6)
            distance, normal = self.cup_radius - reach, -vec3(q.x, q.y, 0.0) / reach
            share = ti.math.clamp((self.cup_height - q.z) / self.h + 0.5, 0.0, 1.0)
        if self.region[b, i] != INSIDE:
            share = 0.0
        return distance, self.turn(b, normal), share

    @ti.func
    def body_velocity(self, b, i):
        return self.wall_velocity[b, i]

    @ti.func
    def contain(self, b):
        limit = self.cup_radius - self.margin
        for i in range(self.alive[b]):
            if self.region[b, i] == INSIDE:
                p = self.position[b, i]
                q = self.to_cup(b, p)
                reach = ti.sqrt(q.x * q.x + q.y * q.y)
                if q.z < self.cup_height and (reach > limit or q.z < self.margin):
                    inward = ti.min(limit / ti.max(reach, 1e-6), 1.0)
                    q = vec3(inward * q.x, inward * q.y, ti.max(q.z, self.margin))
                    inside = self.to_world(b, q)
                    self.position[b, i] = inside
                    self.velocity[b, i] = self.velocity[b, i] + (inside - p) / self.dt

    @ti.func
    def follow(self, b):
        """Update each particle's region; a wall is crossed only over the rim."""
        for i in range(self.alive[b]):
            q = self.to_cup(b, self.position[b, i])
            if q.z >= self.cup_height:
                self.region[b, i] = ABOVE
            elif self.region[b, i] == ABOVE:
                within = q.x * q.x + q.y * q.y < self.cup_radius * self.cup_radius
                self.region[b, i] = ti.select(within, INSIDE, OUTSIDE)

    @ti.func
    def catch(self, b):
        """Take particles that fell past the receiver's rim out of the simulation, note where."""
        i = 0
        while i < self.alive[b]:
            p = self.position[b, i]
            if p.z < self.rim and self.region[b, i] != INSIDE:
                self.landing[b, self.landed[b]] = ti.Vector([p.x, p.y])
                self.landed[b] = self.landed[b] + 1
                last = self.alive[b] - 1
                self.alive[b] = last
                self.position[b, i] = self.position[b, last]
                self.velocity[b, i] = self.velocity[b, last]
                self.multiplier[b, i] = self.multiplier[b, last]
                self.region[b, i] = self.region[b, last]
            else:
                i += 1

    @ti.kernel
    def pour(self, active: ti.i32, start: ti.i32, stop: ti.i32, hold: ti.f32):
        """Substeps start..stop-1 of the first `active` pours; each ends after its own hold."""
        for k in range(active * STRIDE):
            if k % STRIDE == 0:
                b = k // STRIDE
                rate = self.rate_of_turn[b]
                steps = ti.cast((self.final_angle / rate + hold) / self.dt, ti.i32)
                for n in range(start, ti.min(stop, steps)):
                    if self.alive[b] > 0 and self.fault[b] == SOUND:
                        self.angle[b] = ti.min(rate * (n + 1) * self.dt, self.final_angle)
                        self.turning[b] = ti.select(self.angle[b] < self.final_angle, rate, 0.0)
                        self.follow(b)
                        self.flow(b)
                        self.catch(b)

    @ti.kernel
    def count(self, active: ti.i32):
        """Count what stayed in the source."""
        for b in range(active):
            self.retained[b] = 0
            for i in range(self.alive[b]):
                if self.region[b, i] == INSIDE:
                    self.retained[b] = self.retained[b] + 1

    def place_cups(self, rate):
        """Set the cups upright, to turn at `rate` [b] in rad/s."""
        ones = self.padded(rate)
        ones[len(rate) :] = 1.0
        self.rate_of_turn.from_numpy(ones)
        for field in (self.angle, self.turning, self.region, self.landed):
            field.fill(0)
