#include "client/cli/commands.h"

#include <grpc/support/log.h>

#include <cstdlib>

int main(int argc, char** argv) {
  // Turns off the log of gRPC, which repeats at each attempt what our error says once. An
  // environment variable would be inherited by a private server.
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  return drape::cli::Main(argc, argv);
}
