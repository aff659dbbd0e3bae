"""The smallest useful program: a cloth hung by two corners on a private server, one second long."""

import drape
from drape import ClothSpec, Grid, Pin

SIDE = 16

with drape.launch() as client, client.session() as session:
    cloth = session.create(ClothSpec(
        grid=Grid(columns=SIDE, rows=SIDE, width_m=1, height_m=1),
        pins=[Pin(particle=0), Pin(particle=SIDE - 1)]))
    for tenth in range(1, 11):
        answer = cloth.step(6)
        x, y, z = answer.positions[0, -1]
        print(f"{answer.time_s[0]:.1f} s: the free corner is at ({x:.3f}, {y:.3f}, {z:.3f}) m")
    print(f"it has {cloth.shape.distance_constraints} constraints")
