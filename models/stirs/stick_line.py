# type: ignore  (Taichi compiles this source and gives these names their types)
"""The stick in the liquid: nodes on its axis that slip through it by a law of drag.

A node sees the liquid through a kernel about as wide as the stick, and pushes it through the same
kernel; the boundary layer, thinner than a cell, is in the law of slip. The stick is a spherical
pendulum that takes the opposite forces.
"""

import math

import taichi as ti

from ..apic.gravity import GRAVITY
from ..apic.lanes import LANES, vec3
from ..apic.rheology import kinematic
from ..apic.transfer import strides
from .slip_law import (
    HELD_RADIUS,
    IMPULSE,
    LARGEST_RATIO,
    LEAST_SEEN,
    PIVOT_DAMPING,
    QUADRATIC,
    TIP,
    line_of,
)


@ti.func
def peskin4(q):
    r = ti.abs(q)
    o = 0.0
    if r < 1.0:
        o = (3.0 - 2.0 * r + ti.sqrt(1.0 + 4.0 * r - 4.0 * r * r)) / 8.0
    elif r < 2.0:
        o = (5.0 - 2.0 * r - ti.sqrt(ti.max(-7.0 + 12.0 * r - 4.0 * r * r, 0.0))) / 8.0
    return o


@ti.data_oriented
class StickLine:
    """The sticks of a `LiquidState`: where they point, how they turn, and their nodes.

    Attributes:
        direction: Unit vector from pivot to tip, shape [groups, LANES].
        swing, turning: Angular velocity [rad/s] and acceleration [rad/s²].
        pivot, velocity, jolt: Of the pivot: place at the step's start [m], velocity at its middle
            [m/s] and mean acceleration around its start [m/s²].
        carried: Acceleration that a node gives the liquid in its volume [m/s²].
        wet_share: Of a node's length, 0 above the surface.
        seen: What a node's kernels see of each component, in full cells.
    """

    def __init__(self, groups, nodes, width):
        """Room for lines of at most `nodes`, with kernels of at most `width` cells."""
        of_lane, node = (groups, LANES), (groups, LANES, nodes)
        self.direction, self.swing, self.turning = (
            ti.Vector.field(3, ti.f32, of_lane) for _ in range(3)
        )
        self.pivot, self.velocity, self.jolt = (
            ti.Vector.field(3, ti.f32, of_lane) for _ in range(3)
        )
        self.mass, self.dry = (ti.field(ti.f32, of_lane) for _ in range(2))
        self.length, self.radius, self.stretch, self.node_volume, self.gyration = (
            ti.field(ti.f32, ()) for _ in range(5)
        )
        self.half, self.tall, self.nodes = (ti.field(ti.i32, ()) for _ in range(3))
        self.weight = ti.field(ti.f32, (*node, 3, 3, width))
        self.base = ti.Vector.field(3, ti.i32, (*node, 3))
        self.seen, self.carried = (ti.Vector.field(3, ti.f32, node) for _ in range(2))
        self.wet_share = ti.field(ti.f32, node)

    def fit(self, stick, cell, depth):
        """Take a `Stick` in liquid of at most `depth` [m], in cells of `cell` [m]."""
        line = line_of(stick.radius, cell, depth)
        self.length[None], self.radius[None] = stick.length, stick.radius
        self.gyration[None] = stick.gyration
        self.stretch[None], self.half[None] = line.stretch, line.half_width
        self.tall[None], self.node_volume[None] = 4, line.node_volume
        self.nodes[None] = line.nodes

    @ti.kernel
    def hang(self, sticks: ti.types.ndarray(ti.f32, 3)):
        """Sticks at rest: direction, mass [kg] and dry friction [N m], shape [5, groups, LANES]."""
        for g, lane in ti.ndrange(sticks.shape[1], LANES):
            for a in ti.static(range(3)):
                self.direction[g, lane][a] = sticks[a, g, lane]
            self.mass[g, lane], self.dry[g, lane] = sticks[3, g, lane], sticks[4, g, lane]
            self.swing[g, lane], self.turning[g, lane] = vec3(0.0), vec3(0.0)
            for n in range(self.nodes[None]):
                self.carried[g, lane, n] = vec3(0.0)


@ti.func
def rows(t):
    """Rows of cells along x in the kernels of a node; a bound that is not known while compiling
    keeps the loops small."""
    return 3 * t.tall[None] * 2 * t.half[None]


@ti.func
def row(s, t, g, lane, n, r):
    """Component, first cell and weight of a row."""
    wide = 2 * t.half[None]
    a, j, k = r // (wide * t.tall[None]), r % wide, r // wide % t.tall[None]
    first = t.base[g, lane, n, a].dot(strides(s)) + j * strides(s)[1] + k * strides(s)[2]
    return a, first, t.weight[g, lane, n, a, 1, j] * t.weight[g, lane, n, a, 2, k]


@ti.func
def place_node(s, t, g, lane, n, x):
    """Weights of a node at x [m] on the faces around it, one-dimensional and of sum 1."""
    for a in range(3):
        for b in range(3):
            at = (x[b] - s.origin[None][b]) / s.cell[None]
            if a != b:
                at -= 0.5
            stretch, half = t.stretch[None], t.half[None]
            if b == 2:
                stretch, half = 1.0, t.tall[None] // 2
            low = ti.cast(ti.floor(at), ti.i32) - (half - 1)
            low = ti.max(0, ti.min(low, s.shape[None][b] - 2 * half))
            total = 0.0
            for i in range(2 * half):
                w = peskin4((low + i - at) / stretch)
                t.weight[g, lane, n, a, b, i] = w
                total += w
            for i in range(2 * half):
                w = t.weight[g, lane, n, a, b, i] / ti.max(total, 1e-6)
                t.weight[g, lane, n, a, b, i] = w
            t.base[g, lane, n, a][b] = low


@ti.func
def liquid_at(s, t, g, lane, n):
    """Full cells of liquid or wall around a node, by component."""
    seen = vec3(0.0)
    for r in range(rows(t)):
        a, first, w = row(s, t, g, lane, n, r)
        for i in range(2 * t.half[None]):
            m = first + i
            seen[a] += w * t.weight[g, lane, n, a, 0, i] * (s.mass[g, a, m][lane] + s.solid[a, m])
    return ti.max(seen, LEAST_SEEN)


@ti.func
def velocity_at(s, t, g, lane, n):
    """Velocity of the liquid, as a node sees it [m/s]; walls are liquid at rest."""
    u = vec3(0.0)
    for r in range(rows(t)):
        a, first, w = row(s, t, g, lane, n, r)
        for i in range(2 * t.half[None]):
            m = first + i
            momentum = s.mass[g, a, m][lane] * s.velocity[g, a, m][lane]
            u[a] += w * t.weight[g, lane, n, a, 0, i] * momentum
    return u / t.seen[g, lane, n]


@ti.func
def push_liquid(s, t, g, lane, n, change):
    """Give the liquid a node's `change` of velocity times the node's volume: what is in the air or
    in a wall takes none, so that the liquid gets what the stick loses."""
    scaled = t.node_volume[None] * change / t.seen[g, lane, n]
    for r in range(rows(t)):
        a, first, w = row(s, t, g, lane, n, r)
        w *= scaled[a]
        for i in range(2 * t.half[None]):
            m = first + i
            if s.mass[g, a, m][lane] > 0.0:
                u = s.velocity[g, a, m][lane] + w * t.weight[g, lane, n, a, 0, i]
                s.velocity[g, a, m][lane] = u


@ti.func
def arm_of(s, t, g, lane, n):
    """Vector from the pivot to a node [m]."""
    return (t.length[None] - (TIP + n + 0.5) * s.cell[None]) * t.direction[g, lane]


@ti.func
def start_line(s, t, g, lane):
    """Place the nodes; give the liquid the carried force and the displaced mass's impulse."""
    dx, dt = s.cell[None], s.dt[None]
    u, w = t.direction[g, lane], t.swing[g, lane]
    section = math.pi * t.radius[None] ** 2 / (t.node_volume[None] * dx**2)
    for n in range(t.nodes[None]):
        arm = arm_of(s, t, g, lane, n)
        x = t.pivot[g, lane] + arm
        wet = ti.math.clamp((s.level[g][lane] - x[2]) / dx + 0.5, 0.0, 1.0)
        if arm.dot(u) < 0.0:
            wet = 0.0  # beyond the pivot
        t.wet_share[g, lane, n] = wet
        if wet > 0.0:
            place_node(s, t, g, lane, n, x)
            t.seen[g, lane, n] = liquid_at(s, t, g, lane, n)
            turned = t.turning[g, lane].cross(arm) + w.cross(w.cross(arm))
            across = t.jolt[g, lane] + turned
            across -= across.dot(u) * u
            impulse = t.carried[g, lane, n] + IMPULSE * section * wet * across
            push_liquid(s, t, g, lane, n, dt * impulse)
        else:
            t.carried[g, lane, n] = vec3(0.0)


@ti.func
def recoil_of(s, t, g, lane):
    """Change of the stick's velocity over the liquid's by a push of all nodes alike, beyond
    what a step takes without overshooting: on coarse cells the nodes outweigh the stick."""
    density, volume = s.density[g][lane], t.node_volume[None] * s.cell[None] ** 3
    moment = 0.0
    for n in range(t.nodes[None]):
        arm = arm_of(s, t, g, lane, n)
        moment += t.wet_share[g, lane, n] * density * volume * arm.dot(arm)
    return ti.max(moment / (t.mass[g, lane] * t.gyration[None]) - LARGEST_RATIO, 0.0)


@ti.func
def slip_line(s, t, g, lane, time):
    """Slip: the carried forces become those of the law, implicitly in each node's own response;
    then the stick turns. `time` is that of the step's middle [s]."""
    dx, dt, radius = s.cell[None], s.dt[None], t.radius[None]
    area, volume, density = math.pi * radius**2, t.node_volume[None] * dx**3, s.density[g][lane]
    stokes = 4.0 * math.pi / ti.log(HELD_RADIUS * t.stretch[None] * dx / radius)
    u, jolt = t.direction[g, lane], t.jolt[g, lane]
    ahead = t.swing[g, lane] + dt * t.turning[g, lane]
    torque, added = vec3(0.0), 0.0
    jolt_across = jolt - jolt.dot(u) * u
    recoil = recoil_of(s, t, g, lane)
    for n in range(t.nodes[None]):
        wet = t.wet_share[g, lane, n]
        if wet > 0.0:
            arm = arm_of(s, t, g, lane, n)
            slip = t.velocity[g, lane] + ahead.cross(arm) - velocity_at(s, t, g, lane, n)
            speed = ti.max(slip.norm(), 1e-6)
            nu = kinematic(s, g, lane, speed / radius, time)
            k = (QUADRATIC * radius * speed + stokes * nu) * dx / volume
            f = t.carried[g, lane, n]
            change = (k * wet * slip - f) / (k * (1.0 + recoil) + 1.0 / dt)
            f += change / dt
            t.carried[g, lane, n] = f
            push_liquid(s, t, g, lane, n, change)
            displaced = IMPULSE * density * area * dx * wet
            torque -= arm.cross(density * volume * f + displaced * jolt_across)
            added += displaced * arm.dot(arm)
    turn_stick(s, t, g, lane, torque, added)


@ti.func
def turn_stick(s, t, g, lane, torque, added):
    """Advance the pendulum by a step, under weight, lift, the pivot's acceleration and the liquid's
    torque [N m] and added inertia [kg m²]; then its end stops at the wall and the floor."""
    dt, length, radius = s.dt[None], t.length[None], t.radius[None]
    mass, per_length = t.mass[g, lane], s.density[g][lane] * math.pi * radius**2
    pivot, jolt = t.pivot[g, lane], t.jolt[g, lane]
    u, w = t.direction[g, lane], t.swing[g, lane]
    dry = ti.math.clamp((pivot[2] - s.level[g][lane]) / ti.max(-u[2], 0.2), 0.0, length)
    displaced = per_length * (length**3 - dry**3) / 3.0
    lever = 0.5 * (length**2 - dry**2) * per_length
    up = vec3(0.0, 0.0, 1.0)
    torque += ((lever - 0.5 * length * mass) * u).cross(GRAVITY * up + jolt)
    torque -= PIVOT_DAMPING * w
    torque -= torque.dot(u) * u
    inertia = mass * t.gyration[None] - displaced + added
    turning = torque / inertia
    w += dt * turning
    loss = dt * t.dry[g, lane] / inertia
    if loss > 0.0:
        w *= ti.max(1.0 - loss / ti.max(w.norm(), 1e-12), 0.0)
    end = pivot + length * u
    out = ti.sqrt(end[0] ** 2 + end[1] ** 2)
    if out + radius > s.cup_radius[None]:
        outward = vec3(end[0], end[1], 0.0) / ti.max(out, 1e-9)
        w = stopped(w, u, t.velocity[g, lane], length, outward)
    w -= w.dot(u) * u
    t.turning[g, lane] = turning
    height = ti.math.clamp((pivot[2] + dt * t.velocity[g, lane][2]) / length, 0.0, 1.0)
    t.swing[g, lane], t.direction[g, lane] = above_floor(w, u, height, dt)


@ti.func
def above_floor(w, u, height, dt):
    """The swing of a step and where it leads, the stick's end no lower than the floor.

    A pivot that is lowered to `height` lengths above the floor turns a stick that stands there out
    to that cosine, however upright it is: its end's speed alone would ask for any rate.
    """
    moved = (u + dt * w.cross(u)).normalized()
    swing = w
    if -moved[2] > height:
        aside = vec3(moved[0], moved[1], 0.0)
        if aside.norm() < 1e-6:
            aside = vec3(1.0, 0.0, 0.0)
        outward = aside.normalized()
        moved = ti.sqrt(1.0 - height**2) * outward - vec3(0.0, 0.0, height)
        axis = -outward.cross(vec3(0.0, 0.0, 1.0))
        rate = (ti.acos(height) - ti.acos(ti.math.clamp(-u[2], 0.0, 1.0))) / dt
        swing += ti.max(rate - w.dot(axis), 0.0) * axis
    return swing, moved


@ti.func
def stopped(w, u, velocity, length, outward):
    """The swing after which the stick's end no longer moves into a wall."""
    into = (velocity + w.cross(length * u)).dot(outward)
    lever = u.cross(outward)
    r = w
    if into > 0.0:
        r -= into / (length * lever.dot(lever) + 1e-12) * lever
    return r
