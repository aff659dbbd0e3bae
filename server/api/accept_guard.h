// Keeps gRPC listening when there are too many connections, or no file descriptors are left.
#pragma once

#include <cstdint>

namespace drape::api {

struct ConnectionLimits {
  // Open at the same time; 0: as many as the limit of open files allows.
  uint32_t max_connections = 0;
  // Of one peer (peer_connections.h); 0: no limit.
  uint32_t max_connections_per_peer = 0;
  // This machine is no peer: all its users would be one, and so would everybody behind a proxy that
  // runs on it. Only tests say otherwise.
  bool is_loopback_exempt = true;
};

// gRPC 1.51 stops accepting for good when accept4 fails with EMFILE, and limits no connections. The
// program therefore has an accept4 of its own (a symbol of the executable goes before that of the C
// library): what cannot be served is accepted and closed at once, so that listening goes on and the
// client sees at once that it is refused. A warning is logged, at most one a second.

// Raises the soft limit of open files to the hard one. Returns the limit; 0: it is not known.
uint64_t RaiseFileLimit();

// For those accepted from now on; some descriptors are left for the server itself. Before the
// server listens.
void LimitConnections(const ConnectionLimits& limits);

// How many connections were closed at once.
uint64_t RefusedConnections();

}  // namespace drape::api
