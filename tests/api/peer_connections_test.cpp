#include "server/api/peer_connections.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "server/api/accept_guard.h"

namespace drape::api {
namespace {

Endpoint EndpointOf(const std::string& address, uint16_t port) {
  sockaddr_storage from{};
  auto& ipv6 = reinterpret_cast<sockaddr_in6&>(from);
  auto& ipv4 = reinterpret_cast<sockaddr_in&>(from);
  if (inet_pton(AF_INET6, address.c_str(), &ipv6.sin6_addr) == 1) {
    from.ss_family = AF_INET6;
    ipv6.sin6_port = htons(port);
  } else {
    EXPECT_EQ(inet_pton(AF_INET, address.c_str(), &ipv4.sin_addr), 1) << address;
    from.ss_family = AF_INET;
    ipv4.sin_port = htons(port);
  }
  Endpoint endpoint;
  EXPECT_TRUE(ToEndpoint(from, endpoint));
  return endpoint;
}

TEST(Endpoint, OfOneMachineOrNetworkIsOnePeer) {
  EXPECT_EQ(EndpointOf("192.0.2.1", 5), EndpointOf("::ffff:192.0.2.1", 5));
  EXPECT_NE(EndpointOf("192.0.2.1", 5), EndpointOf("192.0.2.1", 6));
  EXPECT_EQ(EndpointOf("192.0.2.1", 5).Peer(), EndpointOf("192.0.2.1", 6).Peer());
  EXPECT_NE(EndpointOf("192.0.2.1", 5).Peer(), EndpointOf("192.0.2.2", 5).Peer());
  EXPECT_EQ(EndpointOf("2001:db8::1", 5).Peer(), EndpointOf("2001:db8::ffff:2", 5).Peer());
  EXPECT_NE(EndpointOf("2001:db8::1", 5).Peer(), EndpointOf("2001:db8:0:1::1", 5).Peer());
  for (const char* address : {"127.0.0.1", "127.1.2.3", "::1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(EndpointOf(address, 5).is_loopback()) << address;
  }
  for (const char* address : {"126.0.0.1", "::2", "::", "2001:db8::1", "::ffff:192.0.2.1"}) {
    EXPECT_FALSE(EndpointOf(address, 5).is_loopback()) << address;
  }
  sockaddr_storage local{};
  local.ss_family = AF_UNIX;
  Endpoint endpoint;
  EXPECT_FALSE(ToEndpoint(local, endpoint));
}

TEST(PeerConnections, APeerHasItsOwnAndNoMore) {
  std::set<int> closed;
  PeerConnections peers(
      [&](int descriptor, const Endpoint&) { return !closed.contains(descriptor); });
  const Endpoint a = EndpointOf("192.0.2.1", 1), b = EndpointOf("192.0.2.2", 1);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(peers.Admit(10 + k, a, 3));
  EXPECT_FALSE(peers.Admit(20, a, 3));
  EXPECT_TRUE(peers.Admit(20, b, 3));
  EXPECT_FALSE(peers.Admit(21, a, 3)) << "b has room, a has not";
  closed = {11};
  EXPECT_TRUE(peers.Admit(21, a, 3));
  EXPECT_FALSE(peers.Admit(22, a, 3));
  // A descriptor that has another connection now is no longer one of a's.
  closed = {};
  EXPECT_TRUE(peers.Admit(10, b, 3));
  EXPECT_TRUE(peers.Admit(22, a, 3));
  EXPECT_FALSE(peers.Admit(23, a, 0)) << "none at all";
}

TEST(PeerConnections, RemembersNoMoreThanThereAreDescriptors) {
  PeerConnections peers([](int, const Endpoint&) { return false; });
  for (int k = 0; k < 10'000; ++k) {
    const std::string address = "10.0." + std::to_string(k / 250) + "." + std::to_string(k % 250);
    EXPECT_TRUE(peers.Admit(k % 20, EndpointOf(address, 1), 1));
  }
  EXPECT_EQ(peers.size(), 20u);
}

// accept4 of this program, by real connections of 127.0.0.1 and 127.0.0.2.
class Guard : public testing::Test {
 protected:
  Guard() {
    listener_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in any = AddressOf("127.0.0.1", 0);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&any), sizeof(any)), 0);
    EXPECT_EQ(listen(listener_, 64), 0);
    socklen_t length = sizeof(at_);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&at_), &length);
  }
  ~Guard() override {
    LimitConnections({});
    for (const int socket : sockets_) close(socket);
    close(listener_);
  }

  static sockaddr_in AddressOf(const char* address, uint16_t port) {
    sockaddr_in in{};
    in.sin_family = AF_INET;
    in.sin_port = htons(port);
    inet_pton(AF_INET, address, &in.sin_addr);
    return in;
  }

  // A connection and its descriptor on this side; -1: it was refused.
  int ConnectFrom(const char* address) {
    const int client = socket(AF_INET, SOCK_STREAM, 0);
    sockets_.push_back(client);
    sockaddr_in from = AddressOf(address, 0);
    EXPECT_EQ(bind(client, reinterpret_cast<sockaddr*>(&from), sizeof(from)), 0);
    EXPECT_EQ(connect(client, reinterpret_cast<sockaddr*>(&at_), sizeof(at_)), 0);
    // A client may be told of its connection before the listener has it.
    pollfd incoming{listener_, POLLIN, 0};
    EXPECT_EQ(poll(&incoming, 1, 30'000), 1);
    // Does not wait after a refused one.
    sockaddr_in peer{};
    socklen_t length = sizeof(peer);
    const int accepted =
        accept4(listener_, reinterpret_cast<sockaddr*>(&peer), &length, SOCK_NONBLOCK);
    if (accepted >= 0) sockets_.push_back(accepted);
    return accepted;
  }
  void Close(int socket) {
    std::erase(sockets_, socket);
    close(socket);
  }

  int listener_ = -1;
  sockaddr_in at_{};
  std::vector<int> sockets_;
};

TEST_F(Guard, RefusesWhatAPeerHasTooManyOf) {
  const int flags = fcntl(listener_, F_GETFL);
  fcntl(listener_, F_SETFL, flags | O_NONBLOCK);
  LimitConnections({.max_connections_per_peer = 3, .is_loopback_exempt = false});
  const uint64_t before = RefusedConnections();
  std::vector<int> of_one;
  for (int k = 0; k < 3; ++k) of_one.push_back(ConnectFrom("127.0.0.1"));
  for (const int socket : of_one) EXPECT_GE(socket, 0);
  EXPECT_EQ(ConnectFrom("127.0.0.1"), -1);
  EXPECT_EQ(RefusedConnections(), before + 1);
  // The client sees it at once.
  char byte;
  EXPECT_EQ(recv(sockets_.back(), &byte, 1, 0), -1);
  EXPECT_EQ(errno, ECONNRESET);
  EXPECT_GE(ConnectFrom("127.0.0.2"), 0) << "another peer";
  Close(of_one[1]);
  EXPECT_GE(ConnectFrom("127.0.0.1"), 0);
  EXPECT_EQ(ConnectFrom("127.0.0.1"), -1);
}

TEST_F(Guard, LetsThisMachineThrough) {
  LimitConnections({.max_connections_per_peer = 1});
  for (int k = 0; k < 5; ++k) EXPECT_GE(ConnectFrom("127.0.0.1"), 0);
}

}  // namespace
}  // namespace drape::api
