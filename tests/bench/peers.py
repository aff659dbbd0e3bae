#!/usr/bin/env python3
"""The hanging sheet of `./run bench speed` with simulators that pip installs: peers.py RESULTS_DIR writes RESULTS_DIR/speed_peers.csv.

One sheet of 32×32 particles, 1 m, 0.2 kg, two corners of a row held, let go horizontally, gravity 7° from straight down towards one of
them, 4 s at 60 Hz, one thread: CPU ms per frame (mean), max and RMS of |l − l0| / l0 over the edges along rows and columns in the last
second. The packages go into out/peers-venv, some minutes in all. Not part of ./run bench: then plots.py RESULTS_DIR shows the rows.
"""

import csv
import math
import os
import pathlib
import subprocess
import sys
import time

PACKAGES = ["mujoco==3.9.0", "newton==1.8.0", "warp-lang==1.19.0"]
COLUMNS = ["program", "settings", "status", "particles", "ms_per_frame", "max_strain", "rms_strain"]
SIDE, SIZE_M, MASS_KG, GRAVITY = 32, 1.0, 0.2, 9.81
TILT = math.radians(10) * math.sqrt(0.5)
FRAMES, WINDOW = 240, 60
EDGE_M = SIZE_M / (SIDE - 1)
LONGEST_S = 90  # a setting that would take longer is stopped
# (substeps per frame, solver, its largest number of iterations)
MUJOCO = [(8, "CG", 50), (4, "Newton", 10), (8, "Newton", 10), (16, "Newton", 10)]
# (substeps, iterations) of VBD. (XPBD with stiff springs blows up on this scene.)
NEWTON = [(4, 10), (10, 10), (10, 20), (30, 10)]


def play(step, positions):
    """status, ms per frame, max and RMS strain; `positions` gives [SIDE * SIDE][3], rows together."""
    import numpy

    took_s, largest, sum_sq, count = 0.0, 0.0, 0.0, 0
    step()  # compiles
    for frame in range(1, FRAMES):
        start = time.process_time()
        step()
        took_s += time.process_time() - start
        if took_s / frame * FRAMES > LONGEST_S:
            return "over_time", 1000 * took_s / frame, math.nan, math.nan
        if frame < FRAMES - WINDOW:
            continue
        grid = numpy.asarray(positions(), dtype=float).reshape(SIDE, SIDE, 3)
        if not numpy.isfinite(grid).all():
            return "faulted", 1000 * took_s / frame, math.nan, math.nan
        for ends in (grid[1:] - grid[:-1], grid[:, 1:] - grid[:, :-1]):
            strain = abs(numpy.linalg.norm(ends, axis=2) / EDGE_M - 1)
            largest = max(largest, strain.max())
            sum_sq += (strain**2).sum()
            count += strain.size
    return "ok", 1000 * took_s / (FRAMES - 1), largest, math.sqrt(sum_sq / count)


def play_mujoco(steps, solver, iterations):
    """A flex whose edges are equality constraints, as stiff as the step allows; its grid has diagonals as well."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(f"""
      <mujoco>
        <option timestep="{1 / 60 / steps}" solver="{solver}" iterations="{iterations}" integrator="implicitfast"
                gravity="0 {-GRAVITY * math.cos(TILT)} {GRAVITY * math.sin(TILT)}"><flag contact="disable"/></option>
        <size memory="2G"/>
        <worldbody>
          <flexcomp name="sheet" type="grid" dim="2" count="{SIDE} {SIDE} 1" spacing="{EDGE_M} {EDGE_M} {EDGE_M}" mass="{MASS_KG}"
                    radius="0.001" euler="90 0 0">
            <edge equality="true" solref="{2.05 / 60 / steps} 1" solimp="0.99 0.9999 0.001"/><contact selfcollide="none" contype="0" conaffinity="0"/><pin id="0 {SIDE - 1}"/>
          </flexcomp>
        </worldbody>
      </mujoco>""")
    data = mujoco.MjData(model)

    def positions():  # MuJoCo restarts a simulation that has blown up
        has_blown_up = any(warning.number > 0 for warning in data.warning)
        return data.flexvert_xpos * (math.nan if has_blown_up else 1)

    return play(lambda: mujoco.mj_step(model, data, nstep=steps), positions)


def play_newton(substeps, iterations):
    """Vertex block descent on stiff triangles, Warp's kernels on the cpu."""
    import newton
    import warp

    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -GRAVITY))
    # The first particles lie along x; turned about y, the row rises as gravity would tilt.
    builder.add_cloth_grid(pos=warp.vec3(0, 0, 0), rot=warp.quat_from_axis_angle(warp.vec3(0, 1, 0), TILT), vel=warp.vec3(0, 0, 0),
                           dim_x=SIDE - 1, dim_y=SIDE - 1, cell_x=EDGE_M, cell_y=EDGE_M, mass=MASS_KG / SIDE**2, tri_ke=1e4,
                           tri_ka=1e4, tri_kd=0.0, edge_ke=0.0, edge_kd=0.0, particle_radius=0.001)
    for corner in (0, SIDE - 1):
        builder.particle_mass[corner] = 0.0
    builder.color()
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverVBD(model, iterations=iterations)
    states = [model.state(), model.state()]
    control = model.control()

    def step():
        for _ in range(substeps):
            states[0].clear_forces()
            solver.step(states[0], states[1], control, None, 1 / 60 / substeps)
            states.reverse()

    return play(step, lambda: states[0].particle_q.numpy())


def measure(path):
    from importlib.metadata import version

    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        jobs = [("MuJoCo", "mujoco", play_mujoco, args, f"{args[1]} {args[0]} steps x {args[2]}") for args in MUJOCO]
        jobs += [("Newton", "newton", play_newton, args, f"VBD {args[0]} steps x {args[1]}") for args in NEWTON]
        for program, package, run, args, settings in jobs:
            status, ms, largest, rms = run(*args)
            row = [f"{program} {version(package)}", settings, status, SIDE * SIDE, *(f"{value:.6g}" for value in (ms, largest, rms))]
            writer.writerow(row)
            file.flush()
            print(*row, flush=True)


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    venv = pathlib.Path(__file__).resolve().parents[2] / "out" / "peers-venv"
    python = venv / "bin" / "python"
    if pathlib.Path(sys.prefix) != venv:
        if not python.exists():
            subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        sys.exit(subprocess.run([python, "-B", pathlib.Path(__file__).resolve(), folder], cwd=venv, env={**os.environ, **threads}, check=False).returncode)
    measure(folder / "speed_peers.csv")


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main()
