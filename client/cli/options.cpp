#include "client/cli/options.h"

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "client/cli/state_writers.h"

namespace drape::cli {
namespace {

// The first line, without what surrounds it.
std::string ReadToken(const std::string& path) {
  std::ifstream file(path);
  std::string token;
  file >> token;
  if (token.empty()) throw CLI::ValidationError("--token-file", path + " has no token");
  return token;
}

}  // namespace

CLI::IsMember BackendNames() {
  return CLI::IsMember({"auto", "gl", "cpu", "reference"});
}

CLI::Option* ServerAddress::AddTo(CLI::App& command, const std::string& description) {
  CLI::Option* address = command.add_option("--server", server, description);
  address->type_name("HOST:PORT");
  const auto tls = [this]() -> TlsOptions& {
    return connect.tls ? *connect.tls : connect.tls.emplace();
  };
  command
      .add_flag_callback("--tls", tls, "Encrypt; trust the certificate authorities of this system")
      ->needs(address);
  command
      .add_option_function<std::string>(
          "--tls-ca", [tls](const std::string& path) { tls().authorities_file = path; },
          "Encrypt; trust the PEM certificates in this file")
      ->check(CLI::ExistingFile)
      ->type_name("PEM")
      ->needs(address);
  command
      .add_option_function<std::string>(
          "--tls-server-name", [tls](const std::string& name) { tls().server_name = name; },
          "Encrypt; the name in the server's certificate (default: the host of --server)")
      ->type_name("NAME")
      ->needs(address);
  CLI::Option* certificate =
      command
          .add_option_function<std::string>(
              "--tls-cert", [tls](const std::string& path) { tls().certificate_file = path; },
              "Encrypt; this client's own certificate chain")
          ->check(CLI::ExistingFile)
          ->type_name("PEM")
          ->needs(address);
  CLI::Option* key = command
                         .add_option_function<std::string>(
                             "--tls-key", [tls](const std::string& path) { tls().key_file = path; },
                             "Its private key")
                         ->check(CLI::ExistingFile)
                         ->type_name("PEM")
                         ->needs(certificate);
  certificate->needs(key);
  command
      .add_option_function<std::string>(
          "--token-file", [this](const std::string& path) { connect.token = ReadToken(path); },
          "The tenant's token is in this file (default: $DRAPE_TOKEN)")
      ->check(CLI::ExistingFile)
      ->type_name("FILE")
      ->needs(address);
  command
      .add_option("--tries", connect.retries.max_tries,
                  "How often a request that may arrive twice is sent at most, if no answer comes")
      ->check(CLI::Range(1u, 1000u))
      ->type_name("N")
      ->needs(address)
      ->capture_default_str();
  return address;
}

ConnectOptions ServerAddress::Options() const {
  ConnectOptions options = connect;
  if (const char* token = std::getenv("DRAPE_TOKEN"); options.token.empty() && token != nullptr) {
    options.token = token;
  }
  return options;
}

void ServerOptions::AddTo(CLI::App& command) {
  CLI::Option* server_flag =
      address.AddTo(command, "Address of a running server (default: start a private one)");
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
  if (!address.server.empty()) return address.Connect();
  SpawnOptions spawn;
  spawn.backend = backend;
  return Client::SpawnServer(spawn);
}

void SessionFlags::AddTo(CLI::App& command) {
  address.AddTo(command)->required();
  command.add_option("--session", session, "Name of the session, as `drape create` printed it")
      ->type_name("NAME")
      ->required();
  command.add_option("--cloth", cloths, "Ids of cloths (default: every cloth of the session)")
      ->type_name("ID");
}

}  // namespace drape::cli
