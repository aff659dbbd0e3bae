#include "tests/system/metrics.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

namespace drape::test {
namespace {

// The whole answer, headers too: the end of the connection is its end.
std::string HttpAnswer(uint16_t port, const std::string& path) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int connection = socket(AF_INET, SOCK_STREAM, 0);
  std::string answer;
  if (connect(connection, reinterpret_cast<sockaddr*>(&to), sizeof(to)) == 0) {
    const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
    if (send(connection, request.data(), request.size(), MSG_NOSIGNAL) ==
        static_cast<ssize_t>(request.size())) {
      char part[4096];
      for (ssize_t size; (size = recv(connection, part, sizeof(part), 0)) > 0;) {
        answer.append(part, static_cast<size_t>(size));
      }
    }
  }
  close(connection);
  return answer;
}

}  // namespace

std::string MetricsOf(const ServerProcess& server) {
  const std::string log = server.Log(), line = "metrics_started port=";
  const size_t at = log.find(line);
  if (at == std::string::npos) {
    ADD_FAILURE() << "the server has no --metrics-listen: " << log;
    return {};
  }
  const std::string text =
      HttpAnswer(static_cast<uint16_t>(std::atoi(log.c_str() + at + line.size())), "/metrics");
  EXPECT_NE(text.find(" 200 OK"), std::string::npos) << text;
  return text;
}

double MetricIn(const std::string& metrics, const std::string& name) {
  const std::string line = "\n" + name + " ";
  const size_t at = metrics.find(line);
  if (at == std::string::npos) {
    ADD_FAILURE() << name << " is not in " << metrics;
    return -1;
  }
  return std::atof(metrics.c_str() + at + line.size());
}

}  // namespace drape::test
