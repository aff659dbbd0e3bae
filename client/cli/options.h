// Flags that several commands have.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

#include "drape/client.h"

namespace drape::cli {

// Which server: somebody's, or a private one of the chosen backend.
struct ServerOptions {
  std::string server;  // HOST:PORT; empty = private
  std::string backend = "auto";

  // --server, and --backend, which goes with a private server only.
  void AddTo(CLI::App& command);
  Client Open() const;
};

// Of a server that must be running already, and a session on it.
struct SessionFlags {
  std::string server;
  std::string session;
  std::vector<ClothId> cloths;  // empty = every cloth of the session

  void AddTo(CLI::App& command);
  Session Attach(const Client& client) const { return client.AttachSession(session); }
  Client Connect() const { return Client::Connect(server); }
};

// Required --server=HOST:PORT.
void AddServerFlag(CLI::App& command, std::string* server);

// "auto", "gl", "cpu", "reference".
CLI::IsMember BackendNames();

// Refuses NaN, which ranges let through, and infinities.
CLI::Validator FiniteNumber();

// A path that MakeStateWriter takes.
CLI::Validator StateFileValidator();

}  // namespace drape::cli
