"""peers.py: a batch of hanging sheets by Drape and by MuJoCo's `mujoco.batch`, CPU time of a sheet's frame beside its strain.

32×32 particles, 0.4 m, 0.15 kg/m^2, let go flat with two corners held, 60 frames of 1/60 s, 16 sheets, one thread. Strain:
|l - l0| / l0 of the edges along rows and columns in the second half. MuJoCo's flex stretches by Young's modulus (thickness
1 mm) and steps by its `discrete` integrator, the one that its documentation names for stiff flexes; Drape's sheet does not
stretch. By hand: `build/venv/bin/python tests/bench/python/peers.py`, which installs MuJoCo into out/peers-batch-venv and
writes results/MACHINE_peers.csv.
"""

import json
import pathlib
import re
import subprocess
import sys
import time

MUJOCO = "4.0.0"
SIDE, SIZE_M, DENSITY = 32, 0.4, 0.15
EDGE_M = SIZE_M / (SIDE - 1)
SHEETS, FRAMES = 16, 60
# Young's modulus [Pa], steps per frame
PEERS = [(2e6, 1), (2e6, 4), (1e7, 1), (1e7, 4)]
SUBSTEPS = [20, 52]  # 52: REALTIME


class Strain:
    def __init__(self):
        self.largest, self.sums = 0.0, []

    def add(self, positions):
        import numpy as np

        grid = np.asarray(positions, float).reshape(-1, SIDE, SIDE, 3)
        for ends in (np.diff(grid, axis=1), np.diff(grid, axis=2)):
            strain = abs(np.linalg.norm(ends, axis=-1) / EDGE_M - 1)
            self.largest = max(self.largest, float(strain.max()))
            self.sums.append(float((strain**2).mean()))

    def rms(self):
        return (sum(self.sums) / len(self.sums)) ** 0.5


def by_mujoco():
    import mujoco
    from mujoco.batch import Batch

    rows = []
    for young, steps in PEERS:
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
        batch = Batch(model, nsim=SHEETS, nthread=1)
        positions, strain = batch.bind("flexvert_xpos"), Strain()
        took_s = 0.0
        for frame in range(FRAMES):
            begin = time.process_time()
            batch.step(nstep=steps)
            took_s += time.process_time() - begin
            if frame >= FRAMES // 2:
                strain.add(positions)
        rows.append((f"MuJoCo {mujoco.__version__}", f"Young {young:.0e} Pa; {steps} steps", 1e3 * took_s / FRAMES / SHEETS,
                     strain.largest, strain.rms()))
    return rows


def by_drape():
    import client  # beside this file

    import drape
    from drape import ClothSpec, Grid, Material, Pin, StepSettings

    rows = []
    with drape.launch("cpu", flags=["--threads=1"]) as server, server.session() as session:
        pid = server._connection.server.pid
        for substeps in SUBSTEPS:
            sheets = session.create(ClothSpec(
                grid=Grid(columns=SIDE, rows=SIDE, width_m=SIZE_M, height_m=SIZE_M), pins=[Pin(particle=0), Pin(particle=SIDE - 1)],
                material=Material(areal_density_kg_per_m2=DENSITY), settings=StepSettings(substeps=substeps)), SHEETS)
            strain, begin_s = Strain(), client.server_cpu_s(pid)
            for frame in range(FRAMES):
                positions = sheets.step().positions
                if frame >= FRAMES // 2:
                    strain.add(positions)
            took_s = client.server_cpu_s(pid) - begin_s
            rows.append((f"Drape {drape.__version__}", f"{substeps} substeps", 1e3 * took_s / FRAMES / SHEETS,
                         strain.largest, strain.rms()))
        machine = re.sub(r"[^a-z0-9]+", "-", server.info.device.lower()).strip("-")
    return rows, machine


def main():
    if sys.argv[1:] == ["--mujoco"]:
        print(json.dumps(by_mujoco()))
        return
    here = pathlib.Path(__file__).resolve()
    venv = here.parents[3] / "out/peers-batch-venv"
    if not (venv / "bin/python").exists():
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        subprocess.run([venv / "bin/pip", "install", "--quiet", f"mujoco=={MUJOCO}"], check=True)
    rows, machine = by_drape()
    done = subprocess.run([venv / "bin/python", here, "--mujoco"], check=True, stdout=subprocess.PIPE, text=True)
    rows += json.loads(done.stdout.splitlines()[-1])
    with open(here.parent / f"results/{machine}_peers.csv", "w") as file:
        for row in [("program", "settings", "cpu_ms_per_frame", "max_strain", "rms_strain"), *rows]:
            line = ",".join(f"{v:.4g}" if isinstance(v, float) else v for v in row)
            print(line)
            file.write(line + "\n")


if __name__ == "__main__":
    main()
