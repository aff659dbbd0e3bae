// Requests with ids through a proxy that cuts connections: each is done once.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

constexpr int kWorkers = 4;
constexpr int kRequestsPerWorker = 150;

// Passes bytes on between its clients and a port of this machine, and cuts each connection after
// some random number of them.
class CuttingProxy {
 public:
  explicit CuttingProxy(int target_port) : target_port_(target_port) {
    listener_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&any), sizeof(any)), 0);
    EXPECT_EQ(listen(listener_, 64), 0);
    socklen_t length = sizeof(any);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&any), &length);
    port_ = ntohs(any.sin_port);
    acceptor_ = std::thread([this] { Accept(); });
  }
  ~CuttingProxy() {
    is_over_ = true;
    acceptor_.join();
    for (std::thread& connection : connections_) connection.join();
    close(listener_);
  }
  std::string Address() const { return "127.0.0.1:" + std::to_string(port_); }
  int cuts() const { return cuts_; }

 private:
  void Accept() {
    std::mt19937 random(7);
    while (!is_over_) {
      pollfd ready{listener_, POLLIN, 0};
      if (poll(&ready, 1, 20) <= 0) continue;
      const int client = accept(listener_, nullptr, nullptr);
      if (client < 0) continue;
      const size_t bytes = std::uniform_int_distribution<size_t>(300, 8000)(random);
      connections_.emplace_back([this, client, bytes] { Pass(client, bytes); });
    }
  }

  void Pass(int client, size_t bytes) {
    const int server = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(target_port_));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    bool is_open = connect(server, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0;
    while (is_open && !is_over_) {
      pollfd ready[] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
      if (poll(ready, 2, 20) <= 0) continue;
      for (const auto& [from, into] : {std::pair(0, server), std::pair(1, client)}) {
        if (is_open && ready[from].revents != 0) is_open = Move(ready[from].fd, into, bytes);
      }
    }
    ++cuts_;
    close(client);
    close(server);
  }

  // False: the connection has ended, or is to be cut.
  static bool Move(int from, int into, size_t& bytes) {
    char buffer[512];
    const ssize_t count = recv(from, buffer, std::min(sizeof(buffer), bytes), 0);
    if (count <= 0) return false;
    for (ssize_t sent = 0; sent < count;) {
      const ssize_t more = send(into, buffer + sent, static_cast<size_t>(count - sent), MSG_NOSIGNAL);
      if (more <= 0) return false;
      sent += more;
    }
    bytes -= static_cast<size_t>(count);
    return bytes > 0;
  }

  const int target_port_;
  int listener_ = -1;
  int port_ = 0;
  std::atomic<bool> is_over_ = false;
  std::atomic<int> cuts_ = 0;
  std::thread acceptor_;
  std::vector<std::thread> connections_;  // the acceptor's until it has ended
};

std::unique_ptr<Stub> StubThrough(const CuttingProxy& proxy) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 10);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 10);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
  return v1::SimulationService::NewStub(grpc::CreateCustomChannel(
      proxy.Address(), grpc::InsecureChannelCredentials(), arguments));
}

// Repeats the request until it is answered. Returns how often it was sent.
int StepUntilAnswered(Stub& stub, const v1::StepRequest& request) {
  for (int sent = 1;; ++sent) {
    const auto answer = Call(stub, &Stub::Step, request);
    if (answer.status.ok()) return sent;
    const bool may_repeat = answer.status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                            ReasonOf(answer.status) == "REQUEST_IN_PROGRESS";
    if (!may_repeat || sent > 10000) {
      ADD_FAILURE() << answer.status.error_code() << ": " << answer.status.error_message();
      return sent;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

TEST(CutConnections, EveryRequestIsDoneOnce) {
  ServerProcess server({"--backend=cpu"});
  ASSERT_TRUE(server.WaitUntilUp());
  const auto direct = server.NewStub();
  const std::string session = NewSession(*direct);
  const Ids ids = Create(*direct, HangingSheet(session, 4, 1 + kWorkers));
  CuttingProxy proxy(std::stoi(server.Address().substr(server.Address().rfind(':') + 1)));
  std::atomic<int> repetitions = 0;
  std::vector<std::thread> workers;
  for (int w = 0; w < kWorkers; ++w) {
    workers.emplace_back([&, w] {
      const auto stub = StubThrough(proxy);
      for (int k = 0; k < kRequestsPerWorker; ++k) {
        // The first cloth is everybody's.
        v1::StepRequest request =
            StepsOf(session, {ids[0], ids[static_cast<size_t>(1 + w)]}, 1);
        request.set_request_id(std::to_string(w) + "/" + std::to_string(k));
        repetitions += StepUntilAnswered(*stub, request) - 1;
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  EXPECT_EQ(Get(*direct, session, ids[0]).step(), uint64_t{kWorkers * kRequestsPerWorker});
  for (size_t w = 0; w < kWorkers; ++w) {
    EXPECT_EQ(Get(*direct, session, ids[1 + w]).step(), uint64_t{kRequestsPerWorker});
  }
  EXPECT_GT(proxy.cuts(), 20) << "the connections were hardly cut";
  EXPECT_GT(repetitions, 20) << "hardly a request had to be repeated";
}

}  // namespace
}  // namespace drape::test
