// A server with few file descriptors: it refuses who is too many, says so, and goes on listening.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::steady_clock;

// Closed when it goes.
class Connections {
 public:
  Connections(const std::string& address, int count) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.find(':') + 1))));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    for (int k = 0; k < count; ++k) {
      const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
      if (socket < 0) break;
      sockets_.push_back(socket);
      if (connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) != 0) break;
    }
  }
  ~Connections() {
    for (const int socket : sockets_) close(socket);
  }
  size_t size() const { return sockets_.size(); }

 private:
  std::vector<int> sockets_;
};

class FewDescriptors : public testing::TestWithParam<uint64_t> {};
INSTANTIATE_TEST_SUITE_P(Limits, FewDescriptors, testing::Values(128, 48));

TEST_P(FewDescriptors, WhoComesOnceOthersHaveLeftGetsIn) {
  ServerProcess server({}, {}, GetParam());
  ASSERT_TRUE(server.WaitUntilUp());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 4));
  {
    const Connections others(server.Address(), 300);
    ASSERT_EQ(others.size(), 300u);
    const auto until = steady_clock::now() + std::chrono::seconds(30);
    while (server.Log().find("connection_refused") == std::string::npos) {
      ASSERT_LT(steady_clock::now(), until) << server.Log();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    // Who is in stays in.
    EXPECT_TRUE(Call(*stub, &Stub::Step, StepsOf(session, ids, 1)).status.ok());
  }
  const auto begin = steady_clock::now();
  const auto late = server.NewStub();
  // Until the server has seen that others have left, it may refuse.
  while (!Call(*late, &Stub::Step, StepsOf(session, ids, 1)).status.ok()) {
    ASSERT_LT(steady_clock::now() - begin, std::chrono::seconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace
}  // namespace drape::test
