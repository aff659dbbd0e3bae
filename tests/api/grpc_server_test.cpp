#include "server/api/grpc_server.h"

#include <gtest/gtest.h>

namespace drape::api {
namespace {

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
