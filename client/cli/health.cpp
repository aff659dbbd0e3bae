// drape health: whether a server accepts requests (grpc.health.v1); exit code 1 when it does not.
#include <iostream>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

struct HealthOptions {
  ServerAddress address;
  std::string service;
  bool is_json = false;
};

int CheckHealth(const HealthOptions& options) {
  const Client client = options.address.Connect();
  const bool is_serving = client.CheckHealth(options.service) == Health::kServing;
  const std::string status = is_serving ? "SERVING" : "NOT_SERVING";
  std::cout << (options.is_json ? "{\"status\": \"" + status + "\"}" : status) << "\n";
  return is_serving ? kDone : kFailed;
}

}  // namespace

void AddHealth(CLI::App& app, Action& action) {
  CLI::App* health = app.add_subcommand("health", "Check whether a server accepts requests");
  auto options = std::make_shared<HealthOptions>();
  options->address.AddTo(*health)->required();
  health->add_option("--service", options->service, "gRPC service (default: the whole server)")
      ->type_name("NAME");
  health->add_flag("--json", options->is_json, "Print JSON");
  health->callback([options, &action] { action = [options] { return CheckHealth(*options); }; });
}

}  // namespace drape::cli
