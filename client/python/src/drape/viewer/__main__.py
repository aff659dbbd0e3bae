"""python -m drape.viewer: plays a scene file, or shows a session."""

import argparse
import sys

import drape
from drape.viewer import Window


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m drape.viewer", description=__doc__)
    parser.add_argument("scene", nargs="?", help="a scene file, as `drape run` takes")
    parser.add_argument("--server", help="HOST:PORT; without it a private server is started")
    parser.add_argument("--backend", default="auto", help="of the private server")
    parser.add_argument("--session", help="name of a session to look at, on --server")
    parser.add_argument("--step", action="store_true", help="with --session: step its cloths from here")
    parser.add_argument("--stride", type=int, default=1, help="show every so manieth cloth")
    parser.add_argument("--host", default="127.0.0.1", help="0.0.0.0 lets other machines look on")
    parser.add_argument("--port", type=int, default=8080)
    flags = parser.parse_args(arguments)
    if (flags.scene is None) == (flags.session is None) or (flags.session is not None and flags.server is None):
        parser.error("give a scene file, or --session with --server")
    try:
        client = drape.connect(flags.server) if flags.server else drape.launch(flags.backend)
        with client, client.session(name=flags.session) as session:
            place = {"stride": flags.stride, "host": flags.host, "port": flags.port}
            with (_of_scene(session, flags.scene, place) if flags.scene else _of_session(session, flags.step, place)) as window:
                print(f"look at {window.url}", flush=True)
                window.run()
    except drape.Error as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        pass
    return 0


def _of_scene(session, path, place):
    scene = drape.scene.load(path)
    for cloth in scene.message.cloths:
        cloth.spec.max_grips = max(1, cloth.spec.max_grips)  # one to pull by
    player = scene.play(session)
    moves = any(control.collider_targets for control in scene.message.controls)

    def advance(steps):
        done = player.advance(steps)
        if done < steps:  # the end of the scene: go on without controls
            for cloths in player.cloths:
                cloths.step(steps - done, view=None)

    return Window(player.cloths, advance=advance, reset=player.reset, time_step_s=scene.time_step_s,
                  tracks_colliders=moves, **place)


def _of_session(session, steps, place):
    """Cloths of equally many particles are one batch."""
    groups = {}
    for cloth in session.list():
        groups.setdefault(cloth.shape.particles, []).append(cloth.id)
    if not groups:
        raise drape.FailedPrecondition("the session has no cloths", reason="NO_CLOTHS")
    batches = [session.attach(ids) for ids in groups.values()]
    return Window(batches, advance="step" if steps else None, tracks_colliders=True, **place)


if __name__ == "__main__":
    sys.exit(main())
