#include "tests/system/cutting_proxy.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "server/core/check.h"

namespace drape::test {
namespace {

constexpr int kPoll_ms = 10;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

void SendAtOnce(int descriptor) {
  const int yes = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
}

}  // namespace

int PortOf(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

CuttingProxy::CuttingProxy(int target_port, size_t least_bytes, size_t most_bytes)
    : least_bytes_(least_bytes), most_bytes_(most_bytes), target_port_(target_port) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = Loopback(0);
  DRAPE_CHECK(bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0, "bind");
  DRAPE_CHECK(listen(listener_, 64) == 0, "listen");
  socklen_t length = sizeof(address);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Loop(); });
}

CuttingProxy::~CuttingProxy() {
  is_over_ = true;
  thread_.join();
  close(listener_);
}

void CuttingProxy::Loop() {
  std::vector<pollfd> ready;
  while (!is_over_) {
    if (is_unplugged_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(kPoll_ms));
      continue;
    }
    ready.assign(1, {listener_, POLLIN, 0});
    for (const Connection& c : connections_) {
      // One that waits reads nothing: what its client has sent arrives later.
      ready.push_back({c.server < 0 ? -1 : c.client, POLLIN, 0});
      ready.push_back({c.server, POLLIN, 0});
    }
    poll(ready.data(), ready.size(), kPoll_ms);
    if (const size_t bytes = cut_once_after_.exchange(kNever); bytes != kNever) {
      cuts_new_ones_ = false;
      for (Connection& c : connections_) c = {c.client, c.server, c.target_port, bytes, 0, 0};
    }
    size_t k = 1;
    for (auto c = connections_.begin(); c != connections_.end(); k += 2) {
      if (Pass(*c, ready[k].revents, ready[k + 1].revents)) {
        ++c;
        continue;
      }
      sent_before_cut_ = c->sent;
      received_before_cut_ = c->received;
      ++cuts_;
      close(c->client);
      if (c->server >= 0) close(c->server);
      c = connections_.erase(c);
    }
    if (ready[0].revents != 0) Accept();
  }
  for (const Connection& c : connections_) {
    close(c.client);
    if (c.server >= 0) close(c.server);
  }
}

void CuttingProxy::Accept() {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  SendAtOnce(client);
  std::uniform_real_distribution<double> size(std::log(least_bytes_), std::log(most_bytes_));
  const size_t bytes = cuts_new_ones_ ? static_cast<size_t>(std::exp(size(random_))) : kNever;
  connections_.push_back({client, -1, 0, bytes, 0, 0});
}

int CuttingProxy::ConnectTo(int port) {
  const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in to = Loopback(port);
  if (connect(server, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) {
    SendAtOnce(server);
    return server;
  }
  close(server);
  return -1;
}

bool CuttingProxy::Pass(Connection& c, short client_events, short server_events) const {
  if (c.server < 0) {
    c.target_port = target_port_;
    if (c.target_port == 0) return true;
    c.server = ConnectTo(c.target_port);
    return c.server >= 0;
  }
  if (c.target_port != target_port_) return false;
  if (client_events != 0 && !Move(c.client, c.server, c.bytes_left, c.sent)) {
    return false;
  }
  return server_events == 0 || Move(c.server, c.client, c.bytes_left, c.received);
}

bool CuttingProxy::Move(int from, int into, size_t& bytes_left, size_t& moved) {
  char buffer[4096];
  const ssize_t count = recv(from, buffer, std::min(sizeof(buffer), bytes_left), 0);
  if (count <= 0) return false;
  for (ssize_t sent = 0; sent < count;) {
    const ssize_t more = send(into, buffer + sent, static_cast<size_t>(count - sent), MSG_NOSIGNAL);
    if (more <= 0) return false;
    sent += more;
  }
  moved += static_cast<size_t>(count);
  bytes_left -= static_cast<size_t>(count);
  return bytes_left > 0;
}

}  // namespace drape::test
