#include "client/cli/commands.h"

#include <grpc/support/log.h>

#include <cstdlib>

int main(int argc, char** argv) {
  // Errors say once what gRPC would log at each attempt. Not by the variable: a private server
  // would inherit it.
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  return drape::cli::Main(argc, argv);
}
