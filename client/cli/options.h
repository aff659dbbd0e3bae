// Flags shared by several commands.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

#include "drape/admin.h"
#include "drape/client.h"

namespace drape::cli {

// The address of a running server, and how to trust it.
struct ServerAddress {
  std::string server;  // HOST:PORT
  ConnectOptions connect;

  // --server and, for it, --tls, --tls-ca, --tls-server-name, --tls-cert, --tls-key,
  // --token-file and --tries. Returns --server.
  CLI::Option* AddTo(CLI::App& command, const std::string& description = "Address of the server");
  // With the token of --token-file, else of the environment (DRAPE_TOKEN).
  Client Connect() const { return Client::Connect(server, Options()); }
  Admin ConnectAdmin() const { return Admin::Connect(server, Options()); }

 private:
  ConnectOptions Options() const;
};

// The server: a running one, or a private one of the chosen backend.
struct ServerOptions {
  ServerAddress address;  // of no server: private
  std::string backend = "auto";

  // ServerAddress and --backend, which is for a private server only.
  void AddTo(CLI::App& command);
  Client Open() const;
};

// A server that must be running already, and a session on it.
struct SessionFlags {
  ServerAddress address;
  std::string session;
  std::vector<ClothId> cloths;  // empty = every cloth of the session

  void AddTo(CLI::App& command);
  Session Attach(const Client& client) const { return client.AttachSession(session); }
  // Names the cloths in a request that has cloth_ids and all_cloths.
  template <class Request>
  void Select(Request* request) const {
    request->set_all_cloths(cloths.empty());
    request->mutable_cloth_ids()->Add(cloths.begin(), cloths.end());
  }
};

// "auto", "gl", "cpu", "reference".
CLI::IsMember BackendNames();

// Refuses infinities, and NaN, which ranges accept.
CLI::Validator FiniteNumber();

// A path that MakeStateWriter accepts.
CLI::Validator StateFileValidator();

}  // namespace drape::cli
