"""Stirring by SPlisHSPlasH: CPU seconds for the scene of a JSON file, in its own environment.

The stick is moved along the path, upright, which costs less than to let it swing. The liquid is
let fall into the cup and come to rest first; that time is not counted.
"""

import ctypes
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

FALL = 1.0  # s until the liquid has come to rest
ROUND = 48  # corners of a circle
TALL = 2.2  # times the cup's height, as the liquid starts as blocks beside the stick


def tube(radius, low, high):
    """Vertices [n, 3] and faces [m, 3] of a closed cylinder."""
    angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = [np.column_stack([ring, np.full(ROUND, z)]) for z in (low, high)]
    vertices += [np.array([[0.0, 0.0, low], [0.0, 0.0, high]])]
    k, after = np.arange(ROUND), (np.arange(ROUND) + 1) % ROUND
    faces = [
        np.stack(f, axis=1) for f in ((k, after, after + ROUND), (k, after + ROUND, k + ROUND))
    ]
    floor = np.full(ROUND, 2 * ROUND)
    faces += [np.stack([after, k, floor], axis=1)]
    faces += [np.stack([k + ROUND, after + ROUND, floor + 1], axis=1)]
    return np.concatenate(vertices), np.concatenate(faces)


def write_mesh(path, vertices, faces):
    lines = ["v {} {} {}".format(*v) for v in vertices]
    lines += ["f {} {} {}".format(*(f + 1)) for f in faces]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def blocks(job):
    """Two boxes of liquid beside the stick; the solver leaves out the last particle of a side."""
    size = 2.0 * job["particle_radius"]
    near, far = job["stick_radius"] + size, 0.7 * job["cup_radius"]
    across, along = int((far - near) / size), int(2.0 * far / size)
    layers = round(job["particles"] / (2 * across * along))
    extent = size * (np.array([across, along, layers]) + 1.0)
    starts = np.array([[near, -0.5 * extent[1], size], [-near - extent[0], -0.5 * extent[1], size]])
    return [
        {"denseMode": 0, "start": start.tolist(), "end": (start + extent).tolist()}
        for start in starts
    ]


def scene(job, folder):
    """The scene as SPlisHSPlasH reads it: DFSPH, implicit viscosity, boundaries as volume maps."""
    start = job["position"][0]
    cup = write_mesh(folder / "cup.obj", *tube(job["cup_radius"], 0.0, TALL * job["cup_height"]))
    low = start[2] - job["stick_length"]
    stick = write_mesh(folder / "stick.obj", *tube(job["stick_radius"], low, start[2]))
    body = {"isDynamic": False, "mapThickness": 0.0}
    return {
        "Configuration": {
            "particleRadius": job["particle_radius"],
            "gravitation": [0, 0, -9.81],
            "timeStepSize": 0.001,
            "cflMethod": 1,
            "cflMaxTimeStepSize": 0.0025,
            "simulationMethod": 4,
            "boundaryHandlingMethod": 2,
            "stopAt": FALL + job["time"][-1] - job["time"][0],
        },
        "RigidBodies": [
            {
                **body,
                "geometryFile": cup,
                "isWall": True,
                "mapInvert": True,
                "mapResolution": [30, 30, 60],
            },
            {
                **body,
                "geometryFile": stick,
                "isWall": False,
                "isAnimated": True,
                "mapResolution": [16, 16, 120],
            },
        ],
        "Materials": [
            {
                "id": "Fluid",
                "density0": job["density"],
                "viscosityMethod": 6,
                "viscosity": job["viscosity"] / job["density"],
                "viscosityBoundary": job["viscosity"] / job["density"],
            }
        ],
        "FluidBlocks": blocks(job),
    }


def main():
    job = json.loads(Path(sys.argv[1]).read_text())
    # the wheel finds no libGL of its own
    ctypes.CDLL("libGL.so.1", mode=ctypes.RTLD_GLOBAL)
    import pysplishsplash as splish

    folder = Path(tempfile.mkdtemp())
    file = folder / "scene.json"
    file.write_text(json.dumps(scene(job, folder)))
    # it prints to the same stream as the result
    out, quiet = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    base = splish.Exec.SimulatorBase()
    base.init(
        sceneFile=str(file), useGui=False, initialPause=False, useCache=False, outputDir=str(folder)
    )
    base.initSimulation()
    simulation, clock = splish.Simulation.getCurrent(), splish.TimeManager.getCurrent()
    times = np.array(job["time"]) - job["time"][0]
    shift = np.array(job["position"]) - job["position"][0]
    velocity = np.gradient(shift, times, axis=0)
    began = []

    def along(values, now):
        return np.array([np.interp(now, times, axis) for axis in values.T])

    def step():
        now = clock.getTime() - FALL
        if now >= 0.0:
            began.append(time.process_time())
            stick = simulation.getBoundaryModel(1).getRigidBodyObject()
            stick.setPosition(along(shift, now))
            stick.setVelocity(along(velocity, now))

    base.setTimeStepCB(step)
    base.runSimulation()
    spent = time.process_time() - began[0]
    fluid = simulation.getFluidModel(0)
    position = np.array([fluid.getPosition(n) for n in range(fluid.numActiveParticles())])
    inside = (np.hypot(position[:, 0], position[:, 1]) < job["cup_radius"]) & (position[:, 2] > 0)
    stick = simulation.getBoundaryModel(1).getRigidBodyObject().getPosition()
    result = {
        "cpu_seconds": spent,
        "particles": int(inside.sum()),
        "lost": int((~inside).sum()),
        "steps": len(began),
        "surface": float(np.quantile(position[:, 2], 0.99)),
        "stick": np.asarray(stick, float).tolist(),
    }
    os.dup2(out, 1)
    print(json.dumps(result), flush=True)
    shutil.rmtree(folder)
    os._exit(0)  # its own clean-up crashes


if __name__ == "__main__":
    main()
