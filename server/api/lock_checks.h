// What Abseil does with the locks of gRPC.
#pragma once

namespace drape::api {

// Debian builds Abseil with a search for deadlocks: every lock that gRPC takes is entered into a
// graph. It serves those who develop gRPC. Call once, before anything is served.
void SkipLockChecks();

}  // namespace drape::api
