"""A mesh of one's own as a cloth that touches itself: held by a grip, lifted, drawn.

own_mesh.py [MESH.obj [PICTURE.png]]. Prints where the grip is and how hard the cloth pulls it. A tube by default.
"""

import pathlib
import sys

import drape
from drape import ClothSpec, Collider, Environment, Material, Plane, SelfCollision, Transform

TUBE = pathlib.Path(__file__).resolve().parents[2] / "examples/meshes/tube.obj"
mesh = drape.mesh.load(sys.argv[1] if len(sys.argv) > 1 else TUBE)  # or drape.mesh.from_arrays(positions, triangles)
spec = ClothSpec(
    mesh=mesh, transform=Transform(position_m=[0, 1, 0]), max_grips=1, self_collision=SelfCollision(thickness_m=0.004),
    material=Material(areal_density_kg_per_m2=0.15, friction_static=0.4, friction_dynamic=0.3),
    environment=Environment(colliders=[Collider(plane=Plane(point_m=[0, 0, 0], normal=[0, 1, 0]))]))

with drape.launch() as client, client.session() as session:
    cloths = session.create(spec)
    highest = int(cloths.positions[0, :, 1].argmax())  # positions: [cloths, particles, 3], metres
    cloths.grip([0], particles=[highest])  # from the next step on
    cloths.step(60)
    held = cloths.positions[0, highest]
    cloths.move_grips([0], [held + [0, 0.3, 0]], over_s=1.0)
    answer = cloths.step(120, impulses=True, report=True)
    print(f"the grip is at {answer.grips.positions[0, 0].round(3)} m, and the cloth pulls it with "
          f"{-answer.grips.forces(1 / 60)[0, 0, 1]:.2f} N; crossings: {answer.measure('crossings')[0]}")
    if len(sys.argv) > 2:
        pathlib.Path(sys.argv[2]).write_bytes(cloths.render_png(640, 480))
