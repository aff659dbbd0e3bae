// drape info: version, backend, device and limits of a server.
#include <cstdio>
#include <iostream>
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/message_json.h"
#include "client/cli/options.h"

namespace drape::cli {
namespace {

struct InfoOptions {
  ServerOptions server;
  bool is_json = false;
};

int Info(const InfoOptions& options) {
  const Client client = options.server.Open();
  const v1::ServerInfo info = client.GetServerInfo();
  if (options.is_json) {
    std::cout << MessageJson(info);
    return kDone;
  }
  std::printf("address      %s\n", client.address().c_str());
  std::printf("version      %s\n", info.version().c_str());
  std::printf("incarnation  %s\n", info.incarnation().c_str());
  std::printf("backend      %s (%s)\n", info.backend().c_str(), info.precision().c_str());
  std::printf("device       %s\n", info.device().c_str());
  std::printf("sessions     %u\n", info.session_count());
  std::printf("cloths       %u (%lu particles)\n", info.cloth_count(), info.particle_count());
  std::printf("up for       %.1f s\n", info.uptime_s());
  std::printf("limits\n%s", info.limits().Utf8DebugString().c_str());
  return kDone;
}

}  // namespace

void AddInfo(CLI::App& app, Action& action) {
  CLI::App* info =
      app.add_subcommand("info", "Print version, backend, device and limits of a server");
  auto options = std::make_shared<InfoOptions>();
  options->server.AddTo(*info);
  info->add_flag("--json", options->is_json, "Print JSON");
  info->callback([options, &action] { action = [options] { return Info(*options); }; });
}

}  // namespace drape::cli
