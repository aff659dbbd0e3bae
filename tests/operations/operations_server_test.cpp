#include "server/operations/operations_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace drape {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string Ask(int port, const std::string& method, const std::string& path) {
  const int connection = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(connection, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 0);
  const std::string request = method + " " + path + " HTTP/1.1\r\nHost: x\r\n\r\n";
  EXPECT_EQ(send(connection, request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  std::string answer;
  char buffer[4096];
  for (ssize_t count; (count = recv(connection, buffer, sizeof(buffer), 0)) > 0;) {
    answer.append(buffer, static_cast<size_t>(count));
  }
  close(connection);
  return answer;
}

TEST(OperationsServer, AnswersWhoWatches) {
  int asked = 0;
  auto server = OperationsServer::Start("127.0.0.1:0", [&] {
    ServerNumbers numbers;
    numbers.sessions = static_cast<uint64_t>(++asked);
    return numbers;
  });
  ASSERT_TRUE(server.ok()) << server.status().message();
  const int port = (*server)->port();
  EXPECT_THAT(Ask(port, "GET", "/healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask(port, "GET", "/readyz"), StartsWith("HTTP/1.1 503"));
  (*server)->SetReady(true);
  EXPECT_THAT(Ask(port, "GET", "/readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask(port, "GET", "/metrics"), HasSubstr("\ndrape_sessions 1\n"));
  EXPECT_THAT(Ask(port, "GET", "/metrics"), HasSubstr("\ndrape_sessions 2\n"));
  EXPECT_THAT(Ask(port, "POST", "/metrics"), StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(Ask(port, "GET", "/"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask(port, "GET", "/metrics/../etc/passwd"), StartsWith("HTTP/1.1 404"));
}

TEST(OperationsServer, APortInUseIsSaid) {
  auto first = OperationsServer::Start("localhost:0", [] { return ServerNumbers(); });
  ASSERT_TRUE(first.ok());
  const auto second = OperationsServer::Start("127.0.0.1:" + std::to_string((*first)->port()),
                                              [] { return ServerNumbers(); });
  EXPECT_EQ(second.status().reason(), "METRICS_LISTEN_FAILED");
}

}  // namespace
}  // namespace drape
