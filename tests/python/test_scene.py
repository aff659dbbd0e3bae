import asyncio
import json
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


@pytest.mark.parametrize("change, words", [
    ({"cloths": []}, "cloths"),
    ({"colths": []}, "colths"),
    ({"time_step_s": 0}, "time_step_s"),
    ({"cloths": [{"spec": {"mesh_file": "none.obj"}}]}, "none.obj"),
    ({"cloths": [{"spec": {"scale_m": 2}}]}, "needs mesh_file"),
    ({"cloths": [{"spec": {"settings": {"time_step_s": 0.5}}}]}, "differs from time_step_s"),
    ({"cloths": [3]}, r"cloths\[0\]: 3 is not an object"),
    ({"cloths": [{"spec": 3}]}, r"cloths\[0\].spec: 3 is not an object"),
    ({"cloths": [{"spec": {"environment": 3}}]}, r"cloths\[0\].spec.environment: 3 is not an object"),
    ({"cloths": [{"spec": {"environment": {"colliders": 3}}}]}, r"environment.colliders: 3 is not a list"),
    ({"cloths": [{"spec": {"environment": {"colliders": [3]}}}]}, r"environment.colliders\[0\]: 3 is not an object"),
    ({"cloths": [{"spec": {"mesh_file": 3}}]}, "mesh_file: 3 is not a text"),
    ({"cloths": [{"spec": {"mesh_file": "x.obj", "scale_m": "2"}}]}, "scale_m: must be a number > 0, got '2'"),
    ({"duration_s": -1}, "duration_s: must be >= 0"),
    ({"controls": [{"time_s": -1}]}, r"controls\[0\].time_s: must be >= 0"),
    ({"controls": [{"cloths": [0, 1]}]}, r"controls\[0\].cloths\[1\]: must be below the number of cloths, 1, got 1"),
])
def test_bad_scenes_are_refused(tmp_path, change, words):
    file = tmp_path / "x.json"
    file.write_text(json.dumps({"duration_s": 1, "cloths": [{"spec": {}}], **change}))
    with pytest.raises(drape.Error, match=words):
        drape.scene.load(file)


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
        drape.scene.parse('{"cloths": [{"spec": {}}], "cloths": []}')
    with pytest.raises(drape.InvalidArgument, match="line 1"):
        drape.scene.parse("{")


@pytest.mark.parametrize("scene, field, words", [
    ({"cloths": [{"spec": {"environment": {"gravity": 3}}}]}, "cloths[0].spec.environment.gravity", "gravity_m_per_s2"),
    ({"cloths": [{"spec": {"mesh": {}, "mesh_files": "x"}}]}, "cloths[0].spec.mesh_files", "mesh_file, scale_m"),
    ({"cloths": [{"spec": {}}], "controls": [{"time_s": 0}, {"time": 0}]}, "controls[1].time", "time_s"),
    ({"cloth": [{"spec": {}}]}, "cloth", "cloths"),
    ({"cloths": [{"spec": {"settings": {"preset": "FAST"}}}]}, "cloths[0].spec.settings.preset", "REALTIME"),
])
def test_names_that_are_unknown_are_told_by_path_with_what_is_legal(scene, field, words):
    with pytest.raises(drape.InvalidArgument) as caught:
        drape.scene.parse(json.dumps(scene))
    assert [bad.field for bad in caught.value.fields] == [field] and words in caught.value.fields[0].description


def test_fields_may_have_the_names_of_json():
    assert drape.scene.parse('{"durationS": 2, "cloths": [{"spec": {"maxGrips": 1}}]}').message.duration_s == 2
