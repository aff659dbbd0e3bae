#!/usr/bin/env bash
# Starts the image as compose.yaml does (no rights, read-only, no network but its own) and checks what README.md promises.
# Usage: docker/check_image.sh [IMAGE]      default: drape
# ENGINE='podman --runtime runc' takes another engine, RUN_FLAGS='--gpus all' adds flags of `docker run`.
set -euo pipefail
image=${1:-drape}
read -ra engine <<<"${ENGINE:-docker}"
read -ra extra <<<"${RUN_FLAGS:-}"
container=drape-check-$$
volume=drape-check-$$
tls=$(mktemp -d)
trap '"${engine[@]}" rm -f "$container" >/dev/null 2>&1 || :; "${engine[@]}" volume rm -f "$volume" >/dev/null 2>&1 || :
  rm -rf "$tls"' EXIT

scenes=/usr/local/share/drape/examples
server=--server=127.0.0.1:7743
passed() { printf 'ok    %s\n' "$*"; }
failed() {
  printf 'FAIL  %s\n' "$*"
  "${engine[@]}" logs "$container" 2>&1 | tail -n 20
  exit 1
}
inside() { "${engine[@]}" exec "$container" "$@"; }
# start FLAGS-OF-RUN... -- FLAGS-OF-DRAPED...
start() {
  local flags=()
  while [ "$1" != -- ]; do flags+=("$1"); shift; done
  shift
  "${engine[@]}" run --detach --name "$container" --network none --read-only --tmpfs /tmp --cap-drop ALL \
    --security-opt no-new-privileges --volume "$volume:/var/cache/drape" "${extra[@]}" "${flags[@]}" "$image" "$@" >/dev/null
}
# Ends the container; the exit status of draped.
stop() {
  "${engine[@]}" stop -t 20 "$container" >/dev/null
  "${engine[@]}" inspect --format '{{.State.ExitCode}}' "$container"
  "${engine[@]}" rm "$container" >/dev/null
}
# eventually COMMAND...: for at most 20 s.
eventually() {
  for _ in {1..80}; do
    if "$@" >/dev/null 2>&1; then return; fi
    sleep 0.25
  done
  return 1
}

printf 'image %s: %s bytes\n' "$image" "$("${engine[@]}" image inspect --format '{{.Size}}' "$image")"

start -- --insecure --backend=gl
eventually inside drape health "$server" || failed 'the health check succeeds'
passed "the health check succeeds: $(inside drape health "$server")"
[ "$(inside id -u)" = 10001 ] || failed 'the user is 10001'
inside grep -q '^CapBnd:\s*0*$' /proc/1/status || failed 'the server has no capabilities'
passed 'user 10001, no capabilities'
if inside touch /usr/local/x 2>/dev/null; then failed 'the root is read-only'; fi
passed 'the root is read-only'
line=$(inside drape run "$scenes/hanging_edge.json" "$server") || failed 'a scene is stepped by OpenGL'
passed "$line"
files=$(inside find /var/cache/drape -type f | wc -l)
[ "$files" -gt 0 ] || failed 'the driver keeps compiled shaders in /var/cache/drape'
passed "compiled shaders are kept: $files files"

inside drape run "$scenes/many_cloths.json" "$server" >/dev/null 2>&1 & client=$!
stepping() { inside drape list "$server" | grep -q sessions/; }
eventually stepping || failed 'a client is stepping'
start_s=$SECONDS
[ "$(stop)" = 0 ] || failed 'SIGTERM ends the server with status 0'
wait "$client" || :
passed "SIGTERM under load: status 0 after $((SECONDS - start_s)) s"

start -- # no flags: those of the image
eventually inside drape health "$server" || failed 'the image starts without flags'
passed "the image starts without flags: $(inside drape info "$server" | grep ^device)"
[ "$(stop)" = 0 ] || failed 'status 0'

if "${engine[@]}" run --rm --network none "${extra[@]}" "$image" --backend=cpu >/dev/null 2>&1; then
  failed 'a server without TLS needs --insecure'
fi
passed 'a server without TLS needs --insecure'

openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=localhost -keyout "$tls/key.pem" -out "$tls/cert.pem" 2>/dev/null
chmod 755 "$tls"; chmod 644 "$tls"/*.pem
start --volume "$tls:/etc/drape/tls:ro" -- --tls-cert=/etc/drape/tls/cert.pem --tls-key=/etc/drape/tls/key.pem
eventually inside bash -c ': </dev/tcp/127.0.0.1/7743' || failed 'the health check of compose.tls.yaml succeeds'
inside drape health "$server" --tls-ca=/etc/drape/tls/cert.pem --tls-server-name=localhost >/dev/null ||
  failed 'TLS is answered'
if inside drape health "$server" >/dev/null 2>&1; then failed 'plain text is refused'; fi
[ "$(stop)" = 0 ] || failed 'status 0'
passed 'TLS is answered, plain text is refused'
echo 'all checks passed'
