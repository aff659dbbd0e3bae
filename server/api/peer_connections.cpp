#include "server/api/peer_connections.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>
#include <string_view>

namespace drape::api {
namespace {

constexpr std::array<uint8_t, 12> kIpv4Prefix = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

bool IsIpv4(const std::array<uint8_t, 16>& address) {
  return std::equal(kIpv4Prefix.begin(), kIpv4Prefix.end(), address.begin());
}

}  // namespace

bool Endpoint::is_loopback() const {
  if (IsIpv4(address)) return address[12] == 127;
  return std::all_of(address.begin(), address.end() - 1, [](uint8_t byte) { return byte == 0; }) &&
         address[15] == 1;
}

std::array<uint8_t, 16> Endpoint::Peer() const {
  std::array<uint8_t, 16> peer = address;
  if (!IsIpv4(address)) std::fill(peer.begin() + 8, peer.end(), uint8_t{0});
  return peer;
}

bool ToEndpoint(const sockaddr_storage& from, Endpoint& endpoint) {
  if (from.ss_family == AF_INET) {
    const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(from);
    std::copy(kIpv4Prefix.begin(), kIpv4Prefix.end(), endpoint.address.begin());
    std::memcpy(endpoint.address.data() + kIpv4Prefix.size(), &ipv4.sin_addr, 4);
    endpoint.port = ntohs(ipv4.sin_port);
    return true;
  }
  if (from.ss_family != AF_INET6) return false;
  const auto& ipv6 = reinterpret_cast<const sockaddr_in6&>(from);
  std::memcpy(endpoint.address.data(), &ipv6.sin6_addr, 16);
  endpoint.port = ntohs(ipv6.sin6_port);
  return true;
}

size_t PeerConnections::Hash::operator()(const std::array<uint8_t, 16>& peer) const {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(peer.data()), peer.size()});
}

void PeerConnections::Forget(int descriptor) {
  const auto peer = peer_of_.find(descriptor);
  if (peer == peer_of_.end()) return;
  const auto held = by_peer_.find(peer->second);
  std::erase_if(held->second, [&](const Held& one) { return one.descriptor == descriptor; });
  if (held->second.empty()) by_peer_.erase(held);
  peer_of_.erase(peer);
}

bool PeerConnections::Admit(int descriptor, const Endpoint& endpoint, uint32_t max_per_peer) {
  Forget(descriptor);  // whatever had this descriptor has been closed
  const auto peer = endpoint.Peer();
  if (const auto found = by_peer_.find(peer);
      found != by_peer_.end() && found->second.size() >= max_per_peer) {
    const std::vector<Held> held = found->second;
    for (const Held& one : held) {
      if (!is_open_(one.descriptor, one.endpoint)) Forget(one.descriptor);
    }
  }
  const auto held = by_peer_.try_emplace(peer).first;
  const bool has_room = held->second.size() < max_per_peer;
  if (has_room) {
    held->second.push_back({descriptor, endpoint});
    peer_of_[descriptor] = peer;
  } else if (held->second.empty()) {
    by_peer_.erase(held);
  }
  return has_room;
}

}  // namespace drape::api
