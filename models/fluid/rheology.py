# type: ignore  (Taichi compiles this source and gives these names their types)
"""Viscosity that differs between particles: what the rheology hooks of effects make of it."""

import numpy as np
import taichi as ti

from .pressure import Pressure

LEAST_SUPPORT = 0.05  # determinant of the moments; below it a particle has no gradient to speak of


@ti.data_oriented
class Rheology(Pressure):
    """Holds the liquid effects that a scene is compiled for, and finds each particle's viscosity.

    Without rheology hooks nothing of it is compiled.
    """

    def __init__(self, slots, particles, spacing, numerics, extent, period=(0.0, 0.0)):
        super().__init__(slots, particles, spacing, numerics, extent, period)
        self.viscosity = ti.field(ti.f32, slots)
        self.bring(())

    def bring(self, effects):
        """Compile for these liquid `Effect`s, which act in this order; call before any kernel."""
        self.effects = tuple(effects)
        numbered = list(enumerate(self.effects))
        rheologies = [(n, e.make_rheology()) for n, e in numbered if e.make_rheology]
        self.rheology_at, self.rheology_hooks = _columns(rheologies)
        if self.effects:
            shape = (len(self.effects), self.slots)
            self.coefficient, self.acts = ti.field(ti.f32, shape), ti.field(ti.i32, shape)
            self.substeps = ti.field(ti.i32, self.slots)
        if self.rheology_hooks:
            self.thickness = ti.field(ti.f32, (self.slots, self.particles))
            self.thickest = ti.field(ti.f32, self.slots)

    def start_effects(self, coefficients):
        """Set coefficients, shape [effects, b], and time 0; None: no effect acts."""
        if not self.effects:
            return
        full = np.zeros((len(self.effects), self.slots))
        acts = np.zeros(full.shape, np.int32)
        if coefficients is not None:
            size = coefficients.shape[1]
            neutral = np.array([[e.neutral] for e in self.effects])
            full[:, :size] = coefficients
            acts[:, :size] = coefficients != neutral
        self.coefficient.from_numpy(full.astype(np.float32))
        self.acts.from_numpy(acts)
        self.substeps.fill(0)

    @ti.func
    def flows_differently(self, b):
        """Whether a rheology hook acts in simulation b."""
        found = 0
        for n in ti.static(range(len(self.rheology_hooks))):
            found |= self.acts[ti.static(self.rheology_at[n]), b]
        return found == 1

    @ti.func
    def viscosity_of(self, b, i):
        """Dynamic viscosity [Pa s] of particle i."""
        mu, rate = self.viscosity[b], self.shear_rate(b, i)
        time = self.substeps[b] * self.dt
        for n in ti.static(range(len(self.rheology_hooks))):
            at = ti.static(self.rheology_at[n])
            if self.acts[at, b] == 1:
                mu = self.rheology_hooks[n](mu, rate, time, self.coefficient[at, b])
        return mu

    @ti.func
    def shear_rate(self, b, i):
        """Root of 2 D:D [1/s], D being the symmetric part of the velocity gradient.

        The gradient is exact for linear flows whatever the neighbourhood (Bonet & Lok 1999,
        "Variational and momentum preservation aspects of smooth particle hydrodynamics"), so
        free surfaces and walls do not lower it.
        """
        p, v = self.position[b, i], self.velocity[b, i]
        flow, moments = ti.Matrix.zero(ti.f32, 3, 3), ti.Matrix.zero(ti.f32, 3, 3)
        for k in range(self.pair_start[b, i], self.pair_start[b, i + 1]):
            j = self.pair_other[b, k]
            g = self.gradient(b, k)
            flow += (self.velocity[b, j] - v).outer_product(g)
            moments += self.apart(self.position[b, j], p).outer_product(g)
        if moments.determinant() > LEAST_SUPPORT:
            flow = flow @ moments.inverse()
        strain = 0.5 * (flow + flow.transpose())
        return ti.sqrt(2.0 * (strain * strain).sum())


def _columns(pairs):
    return tuple(zip(*pairs, strict=True)) or ((), ())
