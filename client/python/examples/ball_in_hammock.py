"""A ball that Drape does not know falls into a hammock: it moves by the impulses that the cloth gives to a collider.

ball_in_hammock.py [BALL_KG [SECONDS]]. Prints how much energy the exchange adds at several rates, and which of them will
do. The cloth sees the ball where it was, and the ball feels the cloth one exchange late: what is too slow for the cloth
under the ball, gains.
"""

import sys

import numpy as np

import drape
from drape import ClothSpec, Collider, Environment, Grid, Material, Pin, Sphere, StepSettings

ball_kg = float(sys.argv[1]) if len(sys.argv) > 1 else 0.15
seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 2
SIDE, RADIUS_M, G = 17, 0.1, 9.81
ENOUGH = 0.05  # of the energy of the fall: what gains more bounces, or flies away
CLOTH_KG = 0.2  # a square metre of the default material


def fall(session, rate_hz):
    """The largest energy of ball and cloth above the one at the start, in units of that of the fall."""
    pose = np.array([0.5, 0.25, 0.5])
    velocity = np.zeros(3)
    cloths = session.create(ClothSpec(
        grid=Grid(columns=SIDE, rows=SIDE, width_m=1, height_m=1),
        pins=[Pin(particle=k) for k in (0, SIDE - 1, SIDE * (SIDE - 1), SIDE * SIDE - 1)],
        material=Material(friction_static=0.5, friction_dynamic=0.4),
        environment=Environment(colliders=[Collider(sphere=Sphere(center_m=pose.tolist(), radius_m=RADIUS_M))]),
        settings=StepSettings(time_step_s=1 / rate_hz, substeps=max(1, round(60 * 52 / rate_hz)), sleep_motion_m=0)))
    start, most = None, 0.0
    for _ in range(round(seconds * rate_hz)):
        pose = pose + velocity / rate_hz
        cloths.move_colliders([0], [pose.tolist()])
        answer = cloths.step(impulses=True, report=True)
        velocity = velocity + answer.impulses.colliders[0, 0] / ball_kg - [0, G / rate_hz, 0]
        report = answer.reports[0]
        energy = (report.kinetic_energy_j + report.potential_energy_j + report.strain_energy_j
                  + ball_kg * (velocity @ velocity / 2 + G * pose[1]))
        start = energy if start is None else start
        most = max(most, energy - start)
    cloths.delete()
    return most / (ball_kg * G * 0.25), pose, velocity


with drape.launch("cpu") as client, client.session() as session:
    print(f"a ball of {ball_kg} kg on a cloth of {CLOTH_KG} kg, {seconds} s; energy gained, share of that of the fall:")
    good = []
    for rate_hz in (60, 120, 240, 480):
        gain, pose, velocity = fall(session, rate_hz)
        good += [rate_hz] if gain <= ENOUGH else []
        speed = np.linalg.norm(velocity)
        print(f"{rate_hz:4d} Hz: {gain:9.3f}, the ball ends at y = {pose[1]:.3f} m with {speed:.3f} m/s")
    print(f"exchange at {good[0]} Hz: it gains at most {ENOUGH:.0%}" if good else
          f"all of these rates gain more than {ENOUGH:.0%}: exchange faster, or give the mass to Collider.mass_kg")
