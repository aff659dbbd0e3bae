#include "client/cli/options.h"

#include <cmath>

#include "client/cli/state_writers.h"

namespace drape::cli {

CLI::IsMember BackendNames() {
  return CLI::IsMember({"auto", "gl", "cpu", "reference"});
}

void ServerOptions::AddTo(CLI::App& command) {
  auto* server_flag = command
                          .add_option("--server", server,
                                      "Address of a running server (default: start a private one)")
                          ->type_name("HOST:PORT");
  command
      .add_option("--backend", backend,
                  "Backend of the private server: auto, gl, cpu or reference (default: auto)")
      ->check(BackendNames())
      ->type_name("BACKEND")
      ->excludes(server_flag);
}

CLI::Validator StateFileValidator() {
  return CLI::Validator(
      [](std::string& path) {
        return IsStateFile(path) ? "" : path + " does not end in " + StateFileExtensions();
      },
      "");
}

CLI::Validator FiniteNumber() {
  return CLI::Validator(
      [](std::string& text) {
        double value = 0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return is_number && std::isfinite(value) ? "" : text + " is not a finite number";
      },
      "");
}

Client ServerOptions::Open() const {
  if (!server.empty()) return Client::Connect(server);
  SpawnOptions spawn;
  spawn.backend = backend;
  return Client::SpawnServer(spawn);
}

void AddServerFlag(CLI::App& command, std::string* server) {
  command.add_option("--server", *server, "Address of the server")
      ->type_name("HOST:PORT")
      ->required();
}

void SessionFlags::AddTo(CLI::App& command) {
  AddServerFlag(command, &server);
  command.add_option("--session", session, "Name of the session, as `drape create` printed it")
      ->type_name("NAME")
      ->required();
  command.add_option("--cloth", cloths, "Ids of cloths (default: every cloth of the session)")
      ->type_name("ID");
}

}  // namespace drape::cli
