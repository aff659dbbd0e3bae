"""Sheets that hang by two corners, as environments of Drape, of MuJoCo's `mujoco.batch` and of Newton: what one costs beside how
far it stretches. Part of `./run bench python`; alone: `./run bench python --case peers`.

32×32 particles, 0.4 m, 0.15 kg/m^2, let go flat with two corners held, 60 frames of 1/60 s, one thread. A step of an environment:
4 frames, then all positions. Strain: |l - l0| / l0 of the edges along rows and columns in the second half. MuJoCo's flex stretches
by Young's modulus (thickness 1 mm) and steps by its `discrete` integrator, which MuJoCo asks for with stiff flexes; Newton's
triangles stretch by 10^4 N/m and are solved by vertex block descent, the solver of its cloth examples, on Warp's device of
--device: auto (a GPU if there is one, for which Warp is made), cpu, cuda:0 and so on; Drape's sheet does not stretch. Where Newton
has a GPU, Drape has its row on a GPU, too. Times are those of the processor on CPUs, of the wall on GPUs.
`peers.py --mujoco` and `--newton [DEVICE]` are run by the packages of requirements_peers.txt.
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve()
SIDE, SIZE_M, DENSITY = 32, 0.4, 0.15
EDGE_M = SIZE_M / (SIDE - 1)
FRAMES, STEP_FRAMES = 60, 4
DRAPE_SUBSTEPS = [20, 52]  # 52: REALTIME
MUJOCO = [(2e6, 1), (2e6, 4), (1e7, 1), (1e7, 4)]  # Young's modulus [Pa], steps per frame
NEWTON = [(10, 10), (30, 10)]  # substeps per frame, iterations
ENVS = {"drape": 64, "mujoco": 16, "newton": 2}  # cost goes with their number
ENVS_ON_GPU = 1024  # enough to fill one


def play(program, settings, envs, step, positions, cpu_s, device="cpu"):
    """Row of `envs` sheets; step(): a frame of all; positions(): [envs * SIDE * SIDE, 3], rows together; cpu_s(): the time."""
    import numpy as np

    took_s, largest, squares = 0.0, 0.0, []
    for frame in range(FRAMES):
        begin_s = cpu_s()
        step()
        is_observed = frame % STEP_FRAMES == STEP_FRAMES - 1
        grid = np.asarray(positions(), float).reshape(envs, SIDE, SIDE, 3) if is_observed else None
        took_s += cpu_s() - begin_s
        if not is_observed or frame < FRAMES // 2:
            continue
        for ends in (np.diff(grid, axis=1), np.diff(grid, axis=2)):
            strain = abs(np.linalg.norm(ends, axis=-1) / EDGE_M - 1)
            largest = max(largest, float(strain.max()))
            squares.append(float((strain**2).mean()))
    frame_s = took_s / FRAMES / envs
    return {"program": program, "settings": settings, "device": device, "envs": envs, "ms_per_frame": 1e3 * frame_s,
            "env_steps_per_s": 1 / (STEP_FRAMES * frame_s), "max_strain": largest,
            "rms_strain": float(np.mean(squares)) ** 0.5}


def by_mujoco():
    import mujoco
    from mujoco.batch import Batch

    envs = ENVS["mujoco"]
    for young, steps in MUJOCO:
        model = mujoco.MjModel.from_xml_string(f"""
          <mujoco>
            <option timestep="{1 / 60 / steps}" integrator="discrete" solver="CG" iterations="50" gravity="0 -9.81 0">
              <flag contact="disable"/></option>
            <worldbody>
              <flexcomp name="sheet" type="grid" dim="2" count="{SIDE} {SIDE} 1" spacing="{EDGE_M} {EDGE_M} {EDGE_M}"
                        mass="{DENSITY * SIZE_M**2}" radius="0.001" euler="90 0 0">
                <elasticity young="{young}" poisson="0" thickness="1e-3" elastic2d="stretch"/>
                <contact selfcollide="none" contype="0" conaffinity="0"/><pin id="0 {SIDE - 1}"/>
              </flexcomp>
            </worldbody>
          </mujoco>""")
        batch = Batch(model, nsim=envs, nthread=1)
        places = batch.bind("flexvert_xpos")
        yield play(f"MuJoCo {mujoco.__version__}", f"Young {young:.0e} Pa; {steps} steps", envs,
                   lambda: batch.step(nstep=steps), lambda: places, time.process_time)


def by_newton(choice="auto"):
    import newton
    import warp

    warp.config.quiet = True
    warp.init()
    device = warp.get_device(choice if choice != "auto" else "cuda:0" if warp.is_cuda_available() else "cpu")
    envs = ENVS_ON_GPU if device.is_cuda else ENVS["newton"]
    for substeps, iterations in NEWTON:
        sheet = newton.ModelBuilder()
        sheet.add_cloth_grid(pos=warp.vec3(0, 0, 0), rot=warp.quat_identity(), vel=warp.vec3(0, 0, 0), dim_x=SIDE - 1,
                             dim_y=SIDE - 1, cell_x=EDGE_M, cell_y=EDGE_M, mass=DENSITY * SIZE_M**2 / SIDE**2, tri_ke=1e4,
                             tri_ka=1e4, tri_kd=0.0, edge_ke=0.0, edge_kd=0.0, particle_radius=0.001)
        for corner in (0, SIDE - 1):
            sheet.particle_mass[corner] = 0.0
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, -9.81))
        builder.replicate(sheet, envs)
        builder.color()
        model = builder.finalize(device=device)
        solver = newton.solvers.SolverVBD(model, iterations=iterations)
        states, control = [model.state(), model.state()], model.control()

        def step():
            for _ in range(substeps):
                states[0].clear_forces()
                solver.step(states[0], states[1], control, None, 1 / 60 / substeps)
                states.reverse()
            warp.synchronize_device(device)

        step()  # compiles, if the package's cache does not have the kernels
        states[0].assign(model.state())
        yield play(f"Newton {newton.__version__}", f"VBD {substeps} substeps x {iterations}", envs, step,
                   lambda: states[0].particle_q.numpy(), time.perf_counter if device.is_cuda else time.process_time, str(device))


def by_drape(server_cpu_s, is_on_gpu=False):
    """Rows of Drape; the CPU time of its server and of this process, on a GPU the wall's. server_cpu_s(pid): of a process."""
    import drape
    from drape import ClothSpec, Grid, Material, Pin, StepSettings

    envs = ENVS_ON_GPU if is_on_gpu else ENVS["drape"]
    backend, flags = ("gl", []) if is_on_gpu else ("cpu", ["--threads=1"])
    with drape.launch(backend, flags=flags) as server, server.session() as session:
        pid = server._connection.server.pid
        for substeps in DRAPE_SUBSTEPS:
            sheets = session.create(ClothSpec(
                grid=Grid(columns=SIDE, rows=SIDE, width_m=SIZE_M, height_m=SIZE_M),
                pins=[Pin(particle=0), Pin(particle=SIDE - 1)], material=Material(areal_density_kg_per_m2=DENSITY),
                settings=StepSettings(substeps=substeps)), envs)
            yield play(f"Drape {drape.__version__}", f"{substeps} substeps", envs, lambda: sheets.step(view=None),
                       lambda: sheets.positions,
                       time.perf_counter if is_on_gpu else lambda: server_cpu_s(pid) + time.process_time(), backend)


def of_all(python, server_cpu_s, device="auto"):
    """Rows of all; `python`: the interpreter that has MuJoCo and Newton; `device`: of Newton."""
    rows = list(by_drape(server_cpu_s))
    for flags in (["--mujoco"], ["--newton", device]):
        with tempfile.TemporaryDirectory() as folder:  # MuJoCo writes a log where it runs
            done = subprocess.run([python, "-B", HERE, *flags], check=True, stdout=subprocess.PIPE, text=True, cwd=folder)
        rows += json.loads(done.stdout.splitlines()[-1])
    if rows[-1]["device"] != "cpu":
        rows[len(DRAPE_SUBSTEPS):len(DRAPE_SUBSTEPS)] = by_drape(server_cpu_s, is_on_gpu=True)
    return rows


if __name__ == "__main__":
    of_flag = {"--mujoco": by_mujoco, "--newton": by_newton}
    if len(sys.argv) < 2 or sys.argv[1] not in of_flag:
        sys.exit(__doc__)
    print(json.dumps(list(of_flag[sys.argv[1]](*sys.argv[2:]))))
