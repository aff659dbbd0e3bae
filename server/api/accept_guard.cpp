#include "server/api/accept_guard.h"

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <limits>
#include <mutex>

#include "server/api/peer_connections.h"

namespace drape::api {
namespace {

// Descriptors that connections leave to the server: files, the ports of other services.
constexpr uint64_t kReserve = 32;
constexpr int kNone = std::numeric_limits<int>::max();

// The kernel gives out the lowest free descriptor: one of this number or above means that as many
// are open.
std::atomic<int> first_refused{kNone};
// Given up for a moment to accept a connection when there is no other descriptor.
std::atomic<int> spare{-1};
std::atomic<uint64_t> refused{0};
std::atomic<uint32_t> max_per_peer{0};  // 0: no limit
std::atomic<bool> is_loopback_exempt{true};

// False: it is gone, or over something else than IP.
bool PeerOf(int connection, Endpoint& endpoint) {
  sockaddr_storage from{};
  socklen_t length = sizeof(from);
  return getpeername(connection, reinterpret_cast<sockaddr*>(&from), &length) == 0 &&
         ToEndpoint(from, endpoint);
}

std::mutex peers_mutex;
PeerConnections& Peers() {
  static PeerConnections peers([](int descriptor, const Endpoint& endpoint) {
    Endpoint now;
    return PeerOf(descriptor, now) && now == endpoint;
  });
  return peers;
}

bool HasRoomForPeer(int connection) {
  const uint32_t max = max_per_peer;
  Endpoint endpoint;
  if (max == 0 || !PeerOf(connection, endpoint)) return true;
  if (is_loopback_exempt && endpoint.is_loopback()) return true;
  const std::lock_guard lock(peers_mutex);
  return Peers().Admit(connection, endpoint, max);
}

// Of the port for operators, if that is a socket in the file system: whoever fills the other one
// must not lock them out. kReserve has room for them.
bool IsLocal(int connection) {
  sockaddr_storage address{};
  socklen_t length = sizeof(address);
  return getsockname(connection, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
         address.ss_family == AF_UNIX;
}

int OpenSpare() {
  return open("/dev/null", O_RDONLY | O_CLOEXEC);
}

int OpenDescriptors() {
  int count = 0;
  DIR* const listing = opendir("/proc/self/fd");
  if (listing == nullptr) return 64;
  while (readdir(listing) != nullptr) ++count;
  closedir(listing);
  return count;
}

void Warn(const char* why) {
  using std::chrono::steady_clock;
  static std::atomic<int64_t> last_s{-1};
  const int64_t now_s =
      std::chrono::duration_cast<std::chrono::seconds>(steady_clock::now().time_since_epoch())
          .count();
  if (last_s.exchange(now_s) == now_s) return;
  spdlog::warn("connection_refused reason={} refused={}", why, refused.load());
}

void Refuse(int connection, const char* why) {
  // Without lingering: the other end knows at once, and nothing is kept for it.
  const linger none{1, 0};
  setsockopt(connection, SOL_SOCKET, SO_LINGER, &none, sizeof(none));
  close(connection);
  ++refused;
  Warn(why);
}

using Accept4 = int (*)(int, sockaddr*, socklen_t*, int);

// The next connection that may stay; otherwise as accept4.
int AcceptOne(Accept4 real, int listener, sockaddr* address, socklen_t* length, int flags) {
  const socklen_t room = length != nullptr ? *length : 0;
  for (;;) {
    if (length != nullptr) *length = room;
    int connection = real(listener, address, length, flags);
    if (connection >= 0) {
      const bool has_room = connection < first_refused || IsLocal(connection);
      if (has_room && HasRoomForPeer(connection)) return connection;
      Refuse(connection, has_room ? "max_connections_per_peer" : "max_connections");
      continue;
    }
    if (errno != EMFILE && errno != ENFILE) return -1;
    const int given_up = spare.exchange(-1);
    if (given_up >= 0) close(given_up);
    if (length != nullptr) *length = room;
    connection = real(listener, address, length, flags);
    const int error = errno;
    if (connection >= 0) Refuse(connection, "no_descriptors");
    if (given_up >= 0) spare = OpenSpare();
    if (connection >= 0) continue;
    // Without a descriptor to give up: later, when the next one connects.
    errno = error == EMFILE || error == ENFILE ? EAGAIN : error;
    return -1;
  }
}

}  // namespace

uint64_t RaiseFileLimit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  limit.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0) getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

void LimitConnections(const ConnectionLimits& limits) {
  max_per_peer = limits.max_connections_per_peer;
  is_loopback_exempt = limits.is_loopback_exempt;
  if (spare < 0) spare = OpenSpare();
  rlimit limit{};
  uint64_t descriptors = kNone;
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) descriptors = limit.rlim_cur;
  uint64_t first = descriptors > 2 * kReserve ? descriptors - kReserve : descriptors;
  if (limits.max_connections > 0) {
    first =
        std::min<uint64_t>(first, uint64_t{limits.max_connections} + OpenDescriptors() + kReserve);
  }
  first_refused = static_cast<int>(std::min<uint64_t>(first, kNone));
}

uint64_t RefusedConnections() {
  return refused;
}

}  // namespace drape::api

extern "C" __attribute__((visibility("default"))) int accept4(int listener, sockaddr* address,
                                                              socklen_t* length, int flags) {
  static const auto real = reinterpret_cast<drape::api::Accept4>(dlsym(RTLD_NEXT, "accept4"));
  if (real == nullptr) {
    errno = ENOSYS;
    return -1;
  }
  return drape::api::AcceptOne(real, listener, address, length, flags);
}
