// Which peer has which connections.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

namespace drape::api {

// The other end of a connection over IP.
struct Endpoint {
  std::array<uint8_t, 16> address{};  // IPv4 as ::ffff:a.b.c.d
  uint16_t port = 0;

  bool is_loopback() const;
  // Who counts as one peer: an IPv4 address, or the 64 bits that IPv6 gives to a network, since any
  // machine in it can have any number of addresses.
  std::array<uint8_t, 16> Peer() const;
  friend bool operator==(const Endpoint&, const Endpoint&) = default;
};

// False: the address is of another kind, such as a Unix socket.
bool ToEndpoint(const sockaddr_storage& from, Endpoint& endpoint);

// Counts the connections of each peer. Nobody says when one ends, so what is remembered is looked
// at again before a peer is refused. Not thread-safe.
class PeerConnections {
 public:
  // Whether the descriptor still has a connection with that end.
  using IsOpen = std::function<bool(int descriptor, const Endpoint& endpoint)>;
  explicit PeerConnections(IsOpen is_open) : is_open_(std::move(is_open)) {}

  // Remembers a new connection, or returns false because its peer has `max_per_peer` others.
  bool Admit(int descriptor, const Endpoint& endpoint, uint32_t max_per_peer);
  // Connections remembered, open or not: at most one per descriptor.
  size_t size() const { return peer_of_.size(); }

 private:
  struct Held {
    int descriptor;
    Endpoint endpoint;
  };
  struct Hash {
    size_t operator()(const std::array<uint8_t, 16>& peer) const;
  };

  void Forget(int descriptor);

  const IsOpen is_open_;
  std::unordered_map<std::array<uint8_t, 16>, std::vector<Held>, Hash> by_peer_;  // none is empty
  std::unordered_map<int, std::array<uint8_t, 16>> peer_of_;                      // by descriptor
};

}  // namespace drape::api
