#include "server/api/grpc_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

namespace drape::api {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class UnixSocket : public testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }

  static Result<std::unique_ptr<GrpcServer>> Start(const fs::path& path) {
    ServerOptions options;
    options.listen = "unix:" + path.string();
    return GrpcServer::Start(options, {});
  }
  static std::string WhyNot(const fs::path& path) {
    const auto server = Start(path);
    EXPECT_EQ(server.status().reason(), "LISTEN_FAILED");
    return server.status().message();
  }

  char template_[32] = "/tmp/drape-unix-XXXXXX";
  const fs::path folder_ = mkdtemp(template_);
};

TEST_F(UnixSocket, IsNotTakenFromAServerThatListens) {
  const fs::path path = folder_ / "socket";
  {
    const auto server = Start(path);
    ASSERT_TRUE(server.ok()) << server.status().ToString();
    EXPECT_THAT(WhyNot(path), HasSubstr("another server listens on it"));
    EXPECT_TRUE(fs::is_socket(path)) << "it was taken away";
  }
  // Of a server that has ended it may be taken.
  EXPECT_TRUE(Start(path).ok());
}

TEST_F(UnixSocket, PathsThatCannotBeAreRefusedWithTheReason) {
  EXPECT_THAT(WhyNot(folder_ / "none" / "socket"), HasSubstr("there is no folder"));
  EXPECT_THAT(WhyNot(folder_ / std::string(200, 'x')), HasSubstr("1 to 107 bytes"));
  EXPECT_THAT(WhyNot(folder_), HasSubstr("it is no socket"));
  const fs::path file = folder_ / "file";
  std::ofstream(file) << "kept";
  EXPECT_THAT(WhyNot(file), HasSubstr("it is no socket"));
  EXPECT_EQ(fs::file_size(file), 4u);
}

TEST(GrpcServer, KnowsWhichAddressesOnlyThisMachineReaches) {
  for (const char* listen : {"127.0.0.1:7743", "127.1.2.3:0", "localhost:1", "[::1]:80"}) {
    EXPECT_TRUE(IsLoopback(listen)) << listen;
  }
  for (const char* listen : {"0.0.0.0:7743", "[::]:7743", "10.0.0.1:1", "127.example.org:80",
                             "example.org:80", ":7743"}) {
    EXPECT_FALSE(IsLoopback(listen)) << listen;
  }
}

}  // namespace
}  // namespace drape::api
