#include "client/cli/commands.h"

#include <cstdlib>

int main(int argc, char** argv) {
  // What gRPC logs by itself; errors say it once.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  return drape::cli::Main(argc, argv);
}
