import re

import numpy as np
import pytest

import drape
from conftest import sheet
from drape import checks, masks, v1

WRONG = [
    (lambda c, s: s.step(1.5), "steps: 1.5 is not a whole number in [1, 1000000]"),
    (lambda c, s: s.step(0), "steps: 0 is not a whole number in [1, 1000000]"),
    (lambda c, s: s.step("a"), "steps: 'a' is not"),
    (lambda c, s: s.step(np.array([1.0])), "steps: array([1.]) is not"),
    (lambda c, s: s.step(1 << 40), "steps: 1099511627776 is not"),
    (lambda c, s: s.step(until=-1), "until_step: -1 is not a whole number in [0, 18446744073709551615]"),
    (lambda c, s: s.step(expected=1.5), "expected_step: 1.5 is not"),
    (lambda c, s: s.step(report="yes"), "report: 'yes' is not True or False"),
    (lambda c, s: s.step(request_id=3), "request_id: 3 is not a text"),
    (lambda c, s: s.step(timeout_s=-1), "timeout_s: -1 is not a number of seconds > 0"),
    (lambda c, s: s.step(timeout_s="soon"), "timeout_s: 'soon' is not"),
    (lambda c, s: s.step(ids=[[0], [0, 1]]), "ids: numbers are needed, in lists of equal lengths"),
    (lambda c, s: s.step(ids="all"), "ids: numbers are needed"),
    (lambda c, s: s.step(ids=[2, 1, 1]), "ids: an index is given twice: 1"),
    (lambda c, s: s._session.create(sheet(), -1), "count: -1 is not a whole number in [1, 65536]"),
    (lambda c, s: s._session.create(sheet(), 0), "count: 0 is not a whole number in [1, 65536]"),
    (lambda c, s: drape.Particles(positions_m=np.zeros((1, 3))),
     "Particles.positions_m: array([[0., 0., 0.]]) is not a list of numbers; it is flat, as an array's ravel() is"),
    (lambda c, s: drape.Sphere(center_m=[[0, 1, 0]]), "Sphere.center_m: [[0, 1, 0]] is not a list of numbers; it is flat"),
    (lambda c, s: s._session.create({"grid": 1}), "spec.grid: 1 is not a Grid"),
    (lambda c, s: s._session.create("sheet"), "spec: 'sheet' is not a ClothSpec"),
    (lambda c, s: s._session.create(sheet(), overrides=[3]), "overrides: [3] is not a list of ClothOverride messages"),
    (lambda c, s: s._session.create(sheet(), overrides=v1.ClothOverride()), "overrides: one ClothOverride is not a list of"),
    (lambda c, s: v1.ClothSpec(grid=v1.Sphere()), "ClothSpec.grid: one Sphere is not a Grid"),
    (lambda c, s: s._session.create(v1.Grid()), "spec: one Grid is not a ClothSpec"),
    (lambda c, s: s.topology(3), "row: 3 is not a whole number in [-3, 2]"),
    (lambda c, s: s.describe(None), "row: None is not a whole number in [-3, 2]"),
    (lambda c, s: s._session.create(sheet(), origins="here"), "origins: numbers are needed"),
    (lambda c, s: s._session.create(sheet(), world=b"\xff"), r"world: b'\xff' is not a text"),
    (lambda c, s: s._session.attach([-1]), "ids: -1 is not a whole number in [0, 18446744073709551615]"),
    (lambda c, s: s._session.attach([0.5]), "ids: 0.5 is not"),
    (lambda c, s: s._session.attach(s.ids, spec="sheet"), "spec: 'sheet' is not a ClothSpec"),
    (lambda c, s: s._session.restore("abc"), "snapshot: str is not bytes"),
    (lambda c, s: s._session.restore(b"abc", spec=3), "spec: 3 is not a ClothSpec"),
    (lambda c, s: s.write("abc"), "positions_m: numbers are needed, in lists of equal lengths, got 'abc'"),
    (lambda c, s: s.write(np.zeros((3, 36, 3)), frame="HERE"), "frame: 'HERE' is not one of WORLD, ENVIRONMENT"),
    (lambda c, s: s.read(particles=[-1]), "particles: [-1] is not a list of whole numbers in [0, 4294967295]"),
    (lambda c, s: s.read(particles=[]), "particles: none is named; None means all"),
    (lambda c, s: s.read(out=[1, 2]), "out[positions]: must be an array, got list"),
    (lambda c, s: s.read(out=np.empty((3, 35, 3), np.float32)), "out[positions]: must be a writeable float32 array of shape (3"),
    (lambda c, s: s.read(False, True, out=np.empty((3, 36, 3), np.float64)), "out[velocities]: must be a writeable float32"),
    (lambda c, s: s.read(out={"position": None}), "out: has 'position', but what is read is positions"),
    (lambda c, s: s.read(False, True, out={"positions": None}), "out: has 'positions', but what is read is velocities"),
    (lambda c, s: drape.states.Answer.of_nothing(None, 0, None).measure("max_strian"), "name: 'max_strian' is not a number of"),
    (lambda c, s: drape.states.Answer.of_nothing(None, 0, None).measure("warnings"), "name: 'warnings' is not a number of"),
    (lambda c, s: drape.pack([[1.0], [1.0, 2.0]]), "array: numbers are needed, in lists of equal lengths"),
    (lambda c, s: drape.pack(["a"]), "array: numbers are needed"),
    (lambda c, s: drape.pack([1]), "array: float32, float64 or uint32 is needed, got int64"),
    (lambda c, s: s.delete([3]), "ids: index 3 is not one of the 3 cloths"),
    (lambda c, s: s.save(3), "name: 3 is not a text"),
    (lambda c, s: s.load("a", of=[9]), "of: index 9 is not one of the 3 cloths"),
    (lambda c, s: s.load("a", of=[0.5]), "of: whole numbers are needed, got float64"),
    (lambda c, s: s.reset(overrides=3), "overrides: 3 is not a list of ClothOverride messages"),
    (lambda c, s: s.update(sheet(), 3), "paths: 3 is not a list of texts"),
    (lambda c, s: s.update(3, ["pins"]), "spec: 3 is not a ClothSpec"),
    (lambda c, s: s.move_pins([[0], [0, 1]], 0), "particles: numbers are needed"),
    (lambda c, s: s.move_pins([2**33], 0), "particles: 8589934592 is not a whole number in [0, 4294967295]"),
    (lambda c, s: s.move_pins([0], 1j), "targets_m: numbers are needed"),
    (lambda c, s: s.move_pins([0], ["1"]), "targets_m: numbers are needed"),
    (lambda c, s: s.move_pins([0], None), "targets_m: numbers are needed, in lists of equal lengths, got None"),
    (lambda c, s: s.grip("left", particles=[0]), "slots: numbers are needed"),
    (lambda c, s: s.move_pins([0, 5, 0], 0), "particles: 0 is given twice"),
    (lambda c, s: s.move_colliders([1, 1], 0), "colliders: 1 is given twice"),
    (lambda c, s: s.set_rest_lengths([[0, 1], [2, 3], [4, 4]], 0.1), "constraints: 4 is given twice for one cloth"),
    (lambda c, s: s.grip([0, 0], particles=[1, 2]), "slots: 0 is given twice"),
    (lambda c, s: s.grip([0, 0], nearest_to=[0, 0, 0], radius_m=1), "slots: 0 is given twice"),
    (lambda c, s: s.move_grips([0, 0], 0), "slots: 0 is given twice"),
    (lambda c, s: s.release([0, 0]), "slots: 0 is given twice"),
    (lambda c, s: s.rollout(2, grips=[0, 0], grip_targets=[0, 0, 0]), "grips: 0 is given twice"),
    (lambda c, s: s._session.attach([7, 2**63 + 1, 2**63 + 1]), f"ids: {2**63 + 1} is given twice"),
    (lambda c, s: s.render("wide"), "width_px: 'wide' is not a whole number in [0, 4294967295]"),
    (lambda c, s: s.render(64, 64, width_px=3), "width_px: is no option: the other arguments say it"),
    (lambda c, s: s.render_tiles(64, 64, drape.Camera(), encoding="PNG"), "encoding: is no option"),
    (lambda c, s: s.render_png(cloth_ids=[1]), "cloth_ids: is no option"),
    (lambda c, s: s.render(colour="red"), "colour: RenderRequest has no such field"),
    (lambda c, s: s.render(colouring="RED"), "colouring: 'RED' is not one of "),
    (lambda c, s: s.pipeline(2.5), "depth: 2.5 is not a whole number in [1, 16]"),
    (lambda c, s: s.frames(every=-1), "every: -1 is not a whole number in [1, 4294967295]"),
    (lambda c, s: s.frames(every=0), "every: 0 is not a whole number in [1, 4294967295]"),
    (lambda c, s: s.run(hz=0), "hz: 0 is not in [0.001, 1e+06] Hz; None is real time"),
    (lambda c, s: s.run(hz=np.float64(0)), "hz: 0 is not in [0.001, 1e+06] Hz"),
    (lambda c, s: s.run(hz="fast"), "steps_hz: 'fast' is not a number"),
    (lambda c, s: s.rollout(-1), "nstep: -1 is not"),
    (lambda c, s: s.step(view=v1.StateView(reductions=["COVERAGE"])), "view.coverage_radius_m: the reduction COVERAGE needs it"),
    (lambda c, s: s.step(view=v1.StateView(reductions=["TARGET_DISTANCE"])), "view.target_m: the reduction TARGET_DISTANCE"),
    (lambda c, s: s.rollout(0), "nstep: 0 is not"),
    (lambda c, s: s.step(ids=slice("a")), "ids: slice(None, 'a', None): slice indices must be integers"),
    (lambda c, s: s.grip([1], particles=[0]), "slots: 1 is not below max_grips of the cloths, 1: give their ClothSpec a larger"),
    (lambda c, s: s.move_grips([2], [0, 0, 0]), "slots: 2 is not below max_grips of the cloths, 1"),
    (lambda c, s: s.release([3]), "slots: 3 is not below max_grips of the cloths, 1"),
    (lambda c, s: drape.launch("cuda"), "backend: the server refuses --backend: cuda not in {auto,gl,cpu,reference}"),
    (lambda c, s: drape.launch("cpu", flags=["--bogus=3"]), "flags: the server refuses The following argument was not expected"),
    (lambda c, s: drape.launch("cpu", flags=["--threads=x"]), "flags: the server refuses --threads: Value x not in range"),
    (lambda c, s: s.grip([0], nearest_to=[0, 0, 0], radius_m=1, at=[0, 0, 0]), "at: goes with particles"),
    (lambda c, s: s.rollout(2, steps=0), "steps: 0 is not"),
    (lambda c, s: s.rollout(2, out=3), "out: the dict of an earlier rollout, or None, got int"),
    (lambda c, s: s.rollout(2, pins="0", pin_targets=[0, 0, 0]), "pins: numbers are needed"),
    (lambda c, s: c.session(ttl_s="long"), "ttl_s: 'long' is not a number"),
    (lambda c, s: c.session(name=s._session.name, ttl_s=-5), "ttl_s: is for a new session; the one of this name keeps its own"),
    (lambda c, s: c.session(name=s._session.name, ttl_s=60), "ttl_s: is for a new session"),
    (lambda c, s: c.session(name=s._session.name, display_name="a"), "display_name: is for a new session"),
    (lambda c, s: c.session(name=3), "name: 3 is not a text"),
    (lambda c, s: c.session(name="é"), "name: 'é' is not a text of printable ASCII"),
    (lambda c, s: drape.connect(None), "address: None is not a text of printable ASCII"),
    (lambda c, s: drape.connect(""), "address: '' is not HOST:PORT with a port in [1, 65535]"),
    (lambda c, s: drape.connect("localhost"), "address: 'localhost' is not HOST:PORT"),
    (lambda c, s: drape.connect("http://localhost:7743"), "address: 'http://localhost:7743' is not HOST:PORT"),
    # gRPC would connect to port 34463.
    (lambda c, s: drape.connect("127.0.0.1:99999"), "address: '127.0.0.1:99999' is not HOST:PORT"),
    (lambda c, s: drape.Retries(tries=0), "tries: 0 is not a whole number in [1, 4294967295]"),
    (lambda c, s: drape.Retries(tries=2.5), "tries: 2.5 is not a whole number in [1, 4294967295]"),
    (lambda c, s: drape.Retries("a"), "tries: 'a' is not a whole number in [1, 4294967295]"),
    (lambda c, s: drape.Retries(first_pause_s=-1), "first_pause_s: -1 is not a finite number >= 0"),
    (lambda c, s: drape.Retries(max_pause_s=float("nan")), "max_pause_s: nan is not a finite number >= 0"),
    (lambda c, s: drape.Retries(budget="x"), "budget: 'x' is not a finite number >= 0"),
    (lambda c, s: drape.Retries(budget="20"), "budget: '20' is not a finite number >= 0"),
    (lambda c, s: drape.Retries(request_ids="yes"), "request_ids: 'yes' is not True or False"),
    (lambda c, s: drape.connect(c.address, retries=3), "retries: 3 is not a drape.Retries, nor None"),
    (lambda c, s: drape.connect(c.address, token="a\n"), "token: the str given is not a text of printable ASCII"),
    (lambda c, s: drape.connect(c.address, timeout_s=0), "timeout_s: 0 is not a number of seconds > 0"),
    (lambda c, s: drape.connect(c.address, tls=3.5), "tls: float is neither PEM bytes nor the path of a file"),
    (lambda c, s: drape.connect(c.address, tls=True, certificate=b"PEM"), "certificate: is not a pair of a chain and its key"),
    (lambda c, s: drape.connect(c.address, tls=True, certificate=("a",)), "certificate: is not a pair"),
    (lambda c, s: drape.launch("cpu", flags="--threads=1"), "flags: a list of texts is needed, got '--threads=1'"),
    (lambda c, s: drape.launch("cpu", ready_timeout_s="1 s"), "ready_timeout_s: '1 s' is not"),
]


@pytest.mark.parametrize("ask, words", WRONG, ids=lambda value: value.split(":")[0] if isinstance(value, str) else "")
def test_what_cannot_be_sent_is_refused_by_field_value_and_range(client, session, ask, words):
    cloths = session.create(sheet(max_grips=1), count=3)
    with pytest.raises(drape.InvalidArgument, match=re.escape(words)) as caught:
        ask(client, cloths)
    assert caught.value.fields[0].field == words.split(":")[0] and caught.value.reason == "BAD_FIELD"
    assert cloths.step().step_count.tolist() == [1, 1, 1] and len(session.list()) == 3


@pytest.mark.parametrize("ask, name", [
    (lambda s: s.randomise(mass=3), "randomise"), (lambda s: s.render_tiles(), "render_tiles"),
    (lambda s: s.save(), "save"), (lambda s: s._session.create(), "create")])
def test_errors_of_arguments_name_the_method_that_was_called(session, ask, name):
    with pytest.raises(TypeError, match=rf"^{name}\(\) (got|missing)"):
        ask(session.create(sheet()))


def test_slices_name_cloths(session):
    cloths = session.create(sheet(), 5)
    assert cloths.step(ids=slice(0, 2)).rows.tolist() == [0, 1] and cloths.step(ids=slice(None, None, -2)).rows.tolist() == [4, 2, 0]
    assert len(cloths.step(ids=slice(3, 3)).rows) == 0 and cloths.step_count.tolist() == [2, 1, 1, 0, 1]


def test_numbers_of_numpy_are_numbers(session):
    cloths = session.create(sheet(), np.int32(2))
    assert cloths.step(np.uint8(3), until=None, expected=np.int64(0), timeout_s=np.float32(9)).step_count.tolist() == [3, 3]
    assert session.attach([int(cloth) for cloth in cloths.ids]).num == 2


@pytest.mark.parametrize("address", ["localhost:1", "[::1]:7743", "a-b.example:65535", "unix:/tmp/x", "dns:///example:7743"])
def test_addresses(address):
    assert checks.address("address", address) == address


def test_a_message_is_that_of_protobuf():
    message = checks.message(v1.StepRequest, session="s", steps=2, expected_step=None)
    assert message == v1.StepRequest(session="s", steps=2) and not message.HasField("expected_step")
    assert checks.whole("x", True, 0, 1) == 1


def test_ids_beyond_the_doubles_are_kept():
    ids = [2**63 + 1, 5]
    assert drape.columns.cloth_ids("ids", ids).tolist() == ids
    assert drape.columns.cloth_ids("ids", np.array(ids, np.uint64)).tolist() == ids


def test_a_mask_takes_what_it_names():
    source = v1.ClothSpec(pins=[v1.Pin(particle=3)], material=v1.Material(air_drag=0.5))
    target = v1.ClothSpec(pins=[v1.Pin(particle=1), v1.Pin(particle=2)], material=v1.Material(air_drag=1, air_lift=2),
                          settings=v1.StepSettings(substeps=3), max_grips=2)
    masks.merge(["pins", "material.air_drag", "settings"], source, target)
    assert target == v1.ClothSpec(pins=[v1.Pin(particle=3)], material=v1.Material(air_drag=0.5, air_lift=2), max_grips=2)
