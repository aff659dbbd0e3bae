// Keeps gRPC listening when there are too many connections, or no file descriptors are left.
#pragma once

#include <cstdint>

namespace drape::api {

// gRPC 1.51 stops accepting for good when accept4 fails with EMFILE, and limits no connections. The
// program therefore has an accept4 of its own (a symbol of the executable goes before that of the C
// library): what cannot be served is accepted and closed at once, so that listening goes on and the
// client sees at once that it is refused. A warning is logged, at most one a second.

// Raises the soft limit of open files to the hard one. Returns the limit; 0: it is not known.
uint64_t RaiseFileLimit();

// At most `max_connections` of those accepted from now on are open at the same time, and some
// descriptors are left for the server itself. 0: as many as the limit of open files allows. Once,
// before the server listens.
void LimitConnections(uint32_t max_connections);

// How many connections were closed at once.
uint64_t RefusedConnections();

}  // namespace drape::api
