"""python -m drape.viewer: plays a scene file, or shows a session."""

import argparse
import os
import pathlib
import sys

import drape
from drape.viewer import Window


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m drape.viewer", description=__doc__)
    parser.add_argument("scene", nargs="?", help="a scene file, as `drape run` takes")
    parser.add_argument("--server", help="HOST:PORT; without it a private server is started")
    # As those of `drape`.
    parser.add_argument("--tls", action="store_true", help="encrypt; trust the certificate authorities of this system")
    parser.add_argument("--tls-ca", metavar="PEM", help="encrypt; trust the certificates in this file")
    parser.add_argument("--tls-cert", metavar="PEM", help="encrypt; this client's own certificate chain")
    parser.add_argument("--tls-key", metavar="PEM", help="its private key")
    parser.add_argument("--token-file", metavar="FILE", help="the tenant's token is in this file (default: $DRAPE_TOKEN)")
    parser.add_argument("--backend", default="auto", help="of the private server")
    parser.add_argument("--session", help="name of a session to look at, on --server")
    parser.add_argument("--step", action="store_true", help="with --session: step its cloths from here")
    parser.add_argument("--stride", type=int, default=1, help="show every so manieth cloth")
    parser.add_argument("--host", default="127.0.0.1", help="0.0.0.0 lets other machines look on")
    parser.add_argument("--port", type=int, default=8080, help="the first one to try (default: %(default)s)")
    flags = parser.parse_args(arguments)
    if (flags.scene is None) == (flags.session is None) or (flags.session is not None and flags.server is None):
        parser.error("give a scene file, or --session with --server")
    if (flags.tls_cert is None) != (flags.tls_key is None):
        parser.error("--tls-cert and --tls-key go together")
    if flags.server is None and (_asks_tls(flags) or flags.token_file):
        parser.error("--tls, --tls-ca, --tls-cert, --tls-key and --token-file are for --server")
    try:
        client = _connected(flags) if flags.server else drape.launch(flags.backend)
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


def _asks_tls(flags):
    return flags.tls or flags.tls_ca is not None or flags.tls_cert is not None


def _connected(flags):
    token = os.environ.get("DRAPE_TOKEN") or None
    if flags.token_file is not None:
        token = _token_in(flags.token_file)
    certificate = None if flags.tls_cert is None else (flags.tls_cert, flags.tls_key)
    return drape.connect(flags.server, tls=flags.tls_ca or _asks_tls(flags), certificate=certificate, token=token)


def _token_in(path):
    """Its first word."""
    try:
        words = pathlib.Path(path).read_text().split(maxsplit=1)
    except (OSError, UnicodeDecodeError) as error:
        raise drape.FailedPrecondition(f"--token-file: {path} cannot be read: {error}", reason="TOKEN_FILE_FAILED") from error
    if not words:
        raise drape.FailedPrecondition(f"--token-file: {path} has no token", reason="TOKEN_FILE_FAILED")
    return words[0]


def _of_scene(session, path, place):
    scene = drape.scene.load(path)
    for cloth in scene.message.cloths:
        cloth.spec.max_grips = max(1, cloth.spec.max_grips)  # one to pull by
    player = scene.play(session)
    moves = any(control.collider_targets for control in scene.message.controls)

    def advance(steps):
        done = player.advance(steps)
        if done < steps:  # the end of the scene: go on without controls
            session.step(player.cloths, steps - done)

    return Window(player.cloths, advance=advance, reset=player.reset, time_step_s=scene.time_step_s,
                  tracks_colliders=moves, **place)


def _of_session(session, steps, place):
    return Window(_batches_of(session), advance="step" if steps else None, tracks_colliders=True, **place)


def _batches_of(session):
    """Cloths of one topology are one batch."""
    by_shape: dict[tuple, list] = {}
    for cloth in session.list():
        shape = cloth.shape
        by_shape.setdefault((shape.particles, shape.distance_constraints, shape.triangles), []).append(cloth.id)
    if not by_shape:
        raise drape.FailedPrecondition("the session has no cloths", reason="NO_CLOTHS")
    batches = []
    for ids in by_shape.values():
        batch = session.attach(ids)
        alike: dict[tuple, list] = {}
        for row, cloth in enumerate(ids):  # 8 x 4 and 4 x 8 have equally many of everything
            topology = batch.topology(row)
            alike.setdefault(tuple(array.tobytes() for array in (
                topology.rest_positions, topology.edges, topology.triangles)), []).append(cloth)
        batches += [batch] if len(alike) == 1 else map(session.attach, alike.values())
    return batches


if __name__ == "__main__":
    sys.exit(main())
