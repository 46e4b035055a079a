"""Attraction of the liquid to the walls of its cup."""

from ..effect import Effect

PULL_AT_ONE = 20.0  # m/s², towards the wall at adhesion 1, halfway through the kernel's support
FRICTION_OVER_PULL = 3.0  # friction over pull
CREEP_SPEED = 0.015  # m/s, below which friction is viscous
DAMPING_RATIO = 0.5  # of critical damping, along the normal


def _prior():
    import numpyro.distributions as dist

    return dist.Uniform(0.0, 1.0)


def _force():
    import taichi as ti

    @ti.func
    def pull(a):
        """Pull over `PULL_AT_ONE` at the distance a h: linear up to h/4, at most 1, smooth at h."""
        bump = a * ti.max(1.0 - a, 0.0)
        return ti.select(a < 0.25, 27.0 / 16.0 * ti.max(a, 0.0), 64.0 * bump * bump * bump)

    @ti.func
    def cling(scene: ti.template(), b, coefficient):  # type: ignore[valid-type]
        damping = DAMPING_RATIO * ti.sqrt(2.0 * PULL_AT_ONE * coefficient / scene.h)
        for i in range(scene.alive[b]):
            added = ti.Matrix.zero(ti.f32, 3, 3)
            for n in ti.static(range(scene.walls)):
                distance, normal, share = scene.wall_near(b, i, n)
                a = distance / scene.h
                if share > 0.0 and a < 1.0:
                    t = 1.0 - a
                    kick = share * scene.dt * PULL_AT_ONE * coefficient * pull(a)
                    v = scene.velocity[b, i] - scene.wall_velocity[b, i]
                    slip = (v - v.dot(normal) * normal).norm()
                    across = normal.outer_product(normal)
                    along = ti.Matrix.identity(ti.f32, 3) - across
                    added += FRICTION_OVER_PULL * kick / (slip + CREEP_SPEED) * along
                    added += share * scene.dt * damping * t * t * across
                    scene.velocity[b, i] = scene.velocity[b, i] - kick * normal
            scene.grip[b, i] = scene.grip[b, i] + added
            scene.ease[b, i] = 1.0 / (1.0 / scene.ease[b, i] + added.trace() / 3.0)

    return cling


EFFECT = Effect(
    name="adhesion",
    unit="1",
    neutral=0.0,
    acts_in="liquid",
    text="The liquid sticks to the walls of its cup: they attract it and rub in proportion, so "
    "that a film stays; 0 to 1 is the useful range, and the stick is left out.",
    source="Particles at a wall are pulled towards it, as in Akinci 2013 (ACM Trans. Graph. 32, "
    "182) with another profile; friction of coefficient 3 under this pull, viscous below 1.5 "
    "cm/s and part of the implicit viscosity, holds them",
    make_prior=_prior,
    make_force=_force,
    lowest=0.0,
    highest=4.0,
)
