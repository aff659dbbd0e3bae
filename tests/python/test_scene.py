import asyncio
import json
import re
import subprocess

import numpy as np
import pytest

import drape
import drape.aio
from conftest import DRAPE, ROOT

EXAMPLES = ROOT / "client/examples"


def run_by_drape(scene, tmp_path, address):
    """Positions and velocities of every step by the command line, in one order: cloth by cloth."""
    file = tmp_path / "states.npz"
    subprocess.run([DRAPE, "run", scene, f"--server={address}", "--every=7",
                    f"--states={file}"], check=True, capture_output=True)
    with np.load(file) as states:
        return {name: states[name] for name in states.files}


SCENES = ["chain", "linkage", "rope", "hanging_edge", "moving_colliders", "sphere_drop", "five_sheets"]


@pytest.mark.parametrize("name", SCENES)
def test_same_bits_as_drape_run(client, tmp_path, name):
    tree = json.loads((EXAMPLES / f"{name}.json").read_text())
    tree["duration_s"] = min(tree["duration_s"], 0.7)
    file = tmp_path / f"{name}.json"
    file.write_text(json.dumps(tree))
    theirs = run_by_drape(file, tmp_path, client.address)
    with client.session() as session:
        player = drape.scene.load(file).play(session)
        for sample, step in enumerate(theirs["steps"]):
            player.advance(int(step) - player.step)
            for name, column in (("positions", 0), ("velocities", 1)):
                mine = np.concatenate([(c.positions, c.velocities)[column].reshape(-1, 3) for c in player.cloths])
                assert mine.tobytes() == np.ascontiguousarray(theirs[name][sample]).tobytes(), (name, step)
        assert player.step == player.scene.step_count


def test_same_bits_as_drape_run_with_grips(client, tmp_path):
    spec = {"grid": {"columns": 8, "rows": 8, "width_m": 0.5, "height_m": 0.5}, "max_grips": 2,
            "pins": [{"particle": 0}]}
    file = tmp_path / "grips.json"
    file.write_text(json.dumps({"duration_s": 0.6, "cloths": [{"spec": spec, "count": 2, "spacing_m": 1}], "controls": [
        {"time_s": 0.1, "grips": [
            {"slot": 0, "action": "GRAB_PARTICLE", "particle": 7, "target_m": [0.5, 0, 0]},
            {"slot": 0, "action": "HOLD", "target_m": [0.4, 0.2, 0], "over_s": 0.2}]},
        {"time_s": 0.2, "cloths": [1], "grips": [
            {"slot": 1, "action": "GRAB_NEAREST", "radius_m": 0.5, "target_m": [0, -0.3, 0.1]}]},
        {"time_s": 0.4, "grips": [{"slot": 0, "action": "RELEASE"}]}]}))
    theirs = run_by_drape(file, tmp_path, client.address)
    with client.session() as session:
        player = drape.scene.load(file).play(session)
        for sample, step in enumerate(theirs["steps"]):
            player.advance(int(step) - player.step)
            mine = np.concatenate([cloths.positions.reshape(-1, 3) for cloths in player.cloths])
            assert mine.tobytes() == np.ascontiguousarray(theirs["positions"][sample]).tobytes(), step
        assert np.ptp(mine[:64, 1]) > 0.1


def test_meshes_are_read_as_the_client_reads_them(session):
    scene = drape.scene.load(EXAMPLES / "mesh_drop.json")
    player = scene.play(session)
    assert player.cloths[0].spec.WhichOneof("topology") == "mesh"
    assert player.advance(3) == 3 and player.cloths[0].step_count[0] == 3
    player.reset()
    assert player.step == 0 and player.cloths[0].step_count[0] == 0


def test_settings_are_set_in_every_spec():
    scene = drape.scene.load(EXAMPLES / "chain.json", {"settings.substeps": 40, "settings.time_step_s": 0.01})
    assert all(cloth.spec.settings.substeps == 40 for cloth in scene.message.cloths)
    assert scene.time_step_s == 0.01


GRID = {"columns": 4, "rows": 4, "width_m": 1, "height_m": 1}
SPEC = {"grid": GRID, "pins": [{"particle": 0}], "max_grips": 1,
        "environment": {"colliders": [{"sphere": {"center_m": [0, -3, 0], "radius_m": 1}}]}}
PLACE = [0, 0, 0]


def with_spec(**fields):
    return {"cloths": [{"spec": {"grid": GRID, **fields}}]}


def with_control(**fields):
    return {"controls": [{}, fields]}


# What a file of one cloth of SPEC has besides; the field that is wrong; words of the error.
BAD = [
    ({"cloths": []}, "cloths", "must have at least one cloth"),
    ({"colths": []}, "colths", "known here: name, time_step_s, duration_s, cloths, controls"),
    ({"time_step_s": 0}, "time_step_s", "must be > 0, got 0"),
    ({"duration_s": -1}, "duration_s", "must be >= 0, got -1"),
    ({"duration_s": 1e12}, "duration_s", "must be at most 10^12 steps"),
    ({"duration_s": "long"}, "duration_s", 'must be a number, got "long"'),
    ({"cloths": [{"spec": {}}]}, "cloths[0].spec", "must have one of grid, mesh, mesh_file and particles"),
    ({"cloths": [3]}, "cloths[0]", "must be an object, got 3"),
    ({"cloths": [{"spec": 3}]}, "cloths[0].spec", "must be an object, got 3"),
    ({"cloths": [{"spec": SPEC, "count": 0}]}, "cloths[0].count", "must be at least 1, got 0"),
    ({"cloths": [{"spec": SPEC, "count": 1.5}]}, "cloths[0].count", "must be a whole number from 0 to 4294967295, got 1.5"),
    (with_spec(environment=3), "cloths[0].spec.environment", "must be an object, got 3"),
    (with_spec(environment={"colliders": 3}), "cloths[0].spec.environment.colliders", "must be a list, got 3"),
    (with_spec(environment={"colliders": [3]}), "cloths[0].spec.environment.colliders[0]", "must be an object, got 3"),
    (with_spec(environment={"gravity": 3}), "cloths[0].spec.environment.gravity", "gravity_m_per_s2"),
    (with_spec(environment={"wind_m_per_s": [[1, 0, 0]]}), "cloths[0].spec.environment.wind_m_per_s[0]",
     "a list inside a list; lists of vectors are flat, got [1,0,0]"),
    (with_spec(settings={"time_step_s": 0.5}), "cloths[0].spec.settings.time_step_s", "differs from time_step_s of the scene"),
    (with_spec(settings={"preset": "FAST"}), "cloths[0].spec.settings.preset", "must be one of PAPER, REALTIME, ACCURATE"),
    (with_spec(settings={"substeps": "8"}), "cloths[0].spec.settings.substeps", "must be a whole number"),
    (with_spec(mesh={}), "cloths[0].spec.mesh", "only one of grid and mesh may be given"),
    (with_spec(mesh_file="x.obj"), "cloths[0].spec.mesh_file", "only one of grid and mesh_file may be given"),
    ({"cloths": [{"spec": {"mesh_file": 3}}]}, "cloths[0].spec.mesh_file", "must be a string, got 3"),
    ({"cloths": [{"spec": {"mesh_files": "x"}}]}, "cloths[0].spec.mesh_files", "mesh_file, scale_m"),
    ({"cloths": [{"spec": {"mesh_file": "none.obj"}}]}, "cloths[0].spec.mesh_file", "no mesh file"),
    ({"cloths": [{"spec": {"scale_m": 2}}]}, "cloths[0].spec.scale_m", "needs mesh_file"),
    ({"cloths": [{"spec": {"mesh_file": "x.obj", "scale_m": "2"}}]}, "cloths[0].spec.scale_m", 'must be a number, got "2"'),
    ({"cloths": [{"spec": {"mesh_file": "x.obj", "scale_m": 0}}]}, "cloths[0].spec.scale_m", "must be > 0, got 0"),
    (with_control(time=0), "controls[1].time", "time_s"),
    (with_control(time_s=-1), "controls[1].time_s", "must be >= 0, got -1"),
    (with_control(cloths=[0, 1]), "controls[1].cloths[1]", "must be below the number of cloths, 1, got 1"),
    (with_control(gravity_m_per_s2=[0, 1]), "controls[1].gravity_m_per_s2", "must have 3 numbers, got 2"),
    (with_control(wind_m_per_s=[0, "NaN", 0]), "controls[1].wind_m_per_s[1]", "must be finite, got nan"),
    (with_control(pin_targets=[{"target_m": [0, 0]}]), "controls[1].pin_targets[0].target_m", "must have 3 numbers, got 2"),
    (with_control(pin_targets=[{"target_m": PLACE}, {"particle": 5, "target_m": PLACE}]),
     "controls[1].pin_targets[1].particle", "particle 5 is not a pin of cloths[0]"),
    (with_control(pin_targets=[{"target_m": PLACE, "over_s": -1}]), "controls[1].pin_targets[0].over_s", "must be >= 0, got -1"),
    (with_control(collider_targets=[{}]), "controls[1].collider_targets[0].position_m", "must have 3 numbers, got 0"),
    (with_control(collider_targets=[{"position_m": PLACE, "rotation_xyzw": PLACE}]),
     "controls[1].collider_targets[0].rotation_xyzw", "must have 4 numbers or none, got 3"),
    (with_control(collider_targets=[{"collider": 1, "position_m": PLACE}]),
     "controls[1].collider_targets[0].collider", "collider 1 is not one of the 1 of cloths[0]"),
    ({"cloths": [{"spec": {"grid": GRID}, "count": 2}, {"spec": SPEC}, {"spec": {"grid": GRID}}],
      "controls": [{"cloths": [2], "pin_targets": [{"target_m": PLACE}]}, {"cloths": [3, 2], "pin_targets": [{"target_m": PLACE}]}]},
     "controls[1].pin_targets[0].particle", "particle 0 is not a pin of cloths[2]"),
    (with_control(rest_lengths=[{"rest_length_m": 0}]), "controls[1].rest_lengths[0].rest_length_m", "must be > 0, got 0"),
    (with_control(rest_length_scale={"scale": 0}), "controls[1].rest_length_scale.scale", "must be > 0, got 0"),
    (with_control(rest_length_scale={"scale": 1, "over_s": -2}), "controls[1].rest_length_scale.over_s", "must be >= 0, got -2"),
    (with_control(grips=[{"action": "HOLD"}]), "controls[1].grips[0].target_m", "must have 3 numbers, got 0"),
    (with_control(grips=[{"action": "GRAB_PARTICLE", "particle": 3}]), "controls[1].grips[0].target_m", "must have 3 numbers, got 0"),
    (with_control(grips=[{"action": "GRAB_NEAREST", "target_m": PLACE}]), "controls[1].grips[0].radius_m", "must be > 0, got 0"),
    (with_control(grips=[{"action": "HOLD", "target_m": PLACE, "slot": 3}]), "controls[1].grips[0].slot",
     "must be below max_grips of cloths[0], 1, got 3"),
    (with_control(grips=[{"action": "RELEASE", "largest_force_n": -1}]), "controls[1].grips[0].largest_force_n",
     "must be >= 0, got -1"),
    (with_control(grips=[{"action": "DROP"}]), "controls[1].grips[0].action", 'RELEASE, got "DROP"'),
    (with_control(grips=[{"target_m": PLACE}]), "controls[1].grips[0].action",
     "must be one of HOLD, GRAB_PARTICLE, GRAB_NEAREST, RELEASE, got none"),
    (with_control(wind_m_per_s=PLACE, cloths=[0, 0]), "controls[1].cloths[1]", "0 is given twice"),
    (with_control(grips=[{"action": 4}]), "controls[1].grips[0].action", "RELEASE, got 4"),
]


@pytest.mark.parametrize("change, field, words", BAD, ids=[field for _, field, _ in BAD])
def test_bad_scenes_are_refused_by_path_in_the_words_of_drape_run(client, tmp_path, change, field, words):
    file = tmp_path / "x.json"
    file.write_text(json.dumps({"duration_s": 1, "cloths": [{"spec": SPEC}], **change}))
    with pytest.raises(drape.Error) as caught:
        drape.scene.load(file)
    (bad,) = caught.value.fields
    assert bad.field == field and words in bad.description
    assert str(file) in str(caught.value) and f"{bad.field}: {bad.description}" in str(caught.value)
    theirs = subprocess.run([DRAPE, "run", file, f"--server={client.address}"], capture_output=True, text=True)
    assert theirs.returncode and f"{bad.field}: {bad.description}" in theirs.stderr


def test_a_scene_made_of_a_message_is_checked_too():
    message = drape.scene.parse(json.dumps({"duration_s": 1, "cloths": [{"spec": SPEC}]})).message
    assert drape.scene.Scene(message).step_count == 60
    message.controls.add().grips.add(target_m=PLACE)
    with pytest.raises(drape.InvalidArgument, match=r"controls\[0\].grips\[0\].action"):
        drape.scene.Scene(message)


def test_what_is_null_is_not_set():
    text = json.dumps({"name": None, "cloths": [{"count": None, "spec": {**SPEC, "mesh": None, "mesh_file": None, "environment": None}}]})
    message = drape.scene.parse(text).message
    assert not message.cloths[0].HasField("count") and message.cloths[0].spec.grid.columns == 4


@pytest.mark.parametrize("text, words", [
    ('{"duration_s": NaN}', 'BAD_JSON: NaN is no number of JSON'), ("[" * 100_000, "BAD_JSON: the values are nested too deep"),
    ("[]", r"BAD_FIELD: Scene: must be an object, got \[\]"), ("null", "cloths: must have at least one cloth"),
    ('{"duration_s": 1' + "0" * 400 + "}", "duration_s: must be a number, got 1000"),
    ('{"cloths": [null]}', r"cloths\[0\]: null stands for nothing"), ('{"timeStep": 1}', "timeStep: unknown field; known"),
    ('{"Time_StepS": 1}', "Time_StepS: unknown field; did you mean time_step_s?"),
])
def test_texts_that_are_no_scene_are_refused(text, words):
    with pytest.raises(drape.InvalidArgument, match=words):
        drape.scene.parse(text)


def test_only_a_session_that_waits_plays(client):
    scene = drape.scene.load(EXAMPLES / "chain.json")

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            with pytest.raises(drape.InvalidArgument, match="session: drape.aio.Session is not a drape.Session"):
                scene.play(mine)

    asyncio.run(program())
    with pytest.raises(drape.InvalidArgument, match="session: builtins.NoneType is not"):
        scene.play(None)


@pytest.mark.parametrize("settings, words", [
    (["settings.substeps"], "settings: a dict of fields by path"),
    ({3: 1}, "settings: a dict of fields by path"),
    ({"settings.substeps.more": 1}, r"cloths\[0\].spec.settings.substeps: 4 is not an object"),
    ({"settings.substeps": -1}, r"cloths\[0\].spec.settings.substeps: must be a whole number from 0 to 4294967295, got -1"),
    ({"settings.substeps": {4}}, r"cloths\[0\].spec.settings.substeps: must be a whole number from 0 to 4294967295, got \{4\}"),
    ({"settings.substep": 1}, r"cloths\[0\].spec.settings.substep: unknown field; known here: preset, .*substeps"),
])
def test_bad_settings_are_refused(settings, words):
    with pytest.raises(drape.InvalidArgument, match=words):
        drape.scene.parse('{"cloths": [{"spec": {"settings": {"substeps": 4}}}]}', settings=settings)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "x.json").write_bytes(b"\xff\xfe")
    with pytest.raises(drape.InvalidArgument, match="x.json"):
        drape.scene.load(tmp_path / "x.json")


def test_an_object_has_each_name_once():
    with pytest.raises(drape.InvalidArgument, match="twice"):
        drape.scene.parse('{"cloths": [{"spec": {"grid": {}}}], "cloths": []}')
    with pytest.raises(drape.InvalidArgument, match="line 1"):
        drape.scene.parse("{")


def test_fields_may_have_the_names_of_json():
    assert drape.scene.parse('{"durationS": 2, "cloths": [{"spec": {"maxGrips": 1, "grid": {}}}]}').message.duration_s == 2
