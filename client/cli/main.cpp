#include "client/cli/commands.h"

#include <absl/synchronization/mutex.h>
#include <grpc/support/log.h>

#include <cstdlib>

int main(int argc, char** argv) {
  // Turns off the log of gRPC, which repeats at each attempt what our error says once. An
  // environment variable would be inherited by a private server.
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  // As in the server (server/api/lock_checks.h), so that `drape load` takes less of the cores.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  return drape::cli::Main(argc, argv);
}
