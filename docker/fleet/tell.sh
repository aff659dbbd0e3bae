#!/usr/bin/env bash
# tell.sh COMMAND: of HAProxy's runtime API, to the proxy of compose.yaml; prints the answer. ("show help" lists them.)
#   docker/fleet/tell.sh "set server sessions/a state drain"
# Its socket is in the container, where nobody else reaches it. Perl is what HAProxy's image has to talk to one.
set -euo pipefail
exec docker compose -f "$(dirname "$0")/compose.yaml" exec -T proxy perl -MIO::Socket::UNIX -e '
  my $haproxy = IO::Socket::UNIX->new("/tmp/drape-fleet.sock") or die "/tmp/drape-fleet.sock: $!\n";
  print $haproxy "$ARGV[0]\n";
  print while <$haproxy>' "${1:?a command}"
