// The entry point: connect to a Drape server, or start a private one.
//
//   drape::Client client = drape::Client::SpawnServer();
//   drape::Session session = client.CreateSession();
//   drape::v1::ClothSpec spec;                          // the description of the cloth
//   ...
//   const drape::ClothId cloth = session.CreateCloth(spec);
//   session.Step(60);
//   const drape::States states = session.ReadStates();
//
// Every call that fails throws drape::Error (drape/error.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drape/error.h"
#include "drape/session.h"
#include "drape/v1/simulation_service.pb.h"

namespace drape {
inline namespace client {

// The certificates to trust over TLS.
struct TlsOptions {
  // PEM certificates of the authorities, or the server's own. Empty: those of gRPC
  // ($GRPC_DEFAULT_SSL_ROOTS_FILE_PATH, else the system's).
  std::filesystem::path authorities_file;
  // The name that the server's certificate must have. Empty: the host of the address.
  std::string server_name;
  // The client's own certificate chain and key (PEM), for servers that ask for them; both or none.
  std::filesystem::path certificate_file = {};
  std::filesystem::path key_file = {};
};

// What a connection sends again by itself: requests that got no answer, if they change nothing,
// have a request_id, or are Steps with expected_step or until_step and without controls, resets and
// loads; and requests of any kind to which the server answers with the time after which to ask
// again.
// Always within the limit of the request's time, and with the same request_id.
struct RetryOptions {
  // How often a request is sent at most, >= 1. 1: nothing is sent again.
  uint32_t max_tries = 6;
  // The pause after the first sending without an answer. Each further one is twice as long, at most
  // max_pause_s [s], and all are up to a fifth longer or shorter by chance.
  double first_pause_s = 0.1;
  double max_pause_s = 2;
  // Each failure takes 1 from the connection's budget, each answer gives 0.1 back; at half of it
  // and below nothing is sent again. So a server that is away gets few requests more than it would
  // get without.
  double budget = 20;
  // Gives a request_id to everything that changes cloths or saved states and has none, streams left
  // out, so that it can be sent again, too. Then the server completes Steps whose client has
  // vanished, keeps answers for a while, and bounds how many ids a session uses (ServerInfo).
  bool gives_request_ids = false;
};

// Options of a connection.
struct ConnectOptions {
  // Longest wait until the server answers, > 0.
  double ready_timeout_s = 5;
  // Limit of each single request that is not a stream; 0 = none. Long Steps need long limits. A
  // server that has vanished is noticed in any case, see keepalive_s.
  double request_timeout_s = 3600;
  // While a call is under way, a server that has sent nothing for keepalive_s is asked for a sign
  // of life, and given up after keepalive_timeout_s more. Servers close connections that ask more
  // often than every 10 s; gRPC asks every second at most.
  double keepalive_s = 30;
  double keepalive_timeout_s = 20;
  // Unset: without TLS, so only for servers of this machine and of private networks.
  std::optional<TlsOptions> tls;
  // The tenant's token, for servers that want one. Give it only together with TLS, or to a server
  // of this machine: whoever reads it is the tenant.
  std::string token = {};
  RetryOptions retries = {};
};

// Options of a private server.
struct SpawnOptions {
  // "auto", "gl", "cpu" or "reference".
  std::string backend = "auto";
  // The program. Empty: $DRAPE_SERVER, else `draped` beside this executable, else on PATH.
  std::filesystem::path executable;
  // Further flags for it, e.g. {"--log-level=debug"}.
  std::vector<std::string> flags;
  // Longest wait until it is ready, > 0. Software GL compiles shaders first.
  double ready_timeout_s = 60;
};

enum class Health { kServing, kNotServing };

struct Connection;  // private

// A connection to one server. Thread-safe. Cheap to move; sessions keep what they need of it alive.
class Client {
 public:
  // `address`: HOST:PORT. Waits until the server answers. Throws kUnavailable when it does not,
  // also when it cannot be trusted, and kFailedPrecondition for a file of authorities that cannot
  // be read.
  static Client Connect(const std::string& address, const ConnectOptions& options = {});

  // Starts `draped` on a free loopback port, in a process group of its own (a Ctrl-C of the
  // terminal does not reach it). It is stopped (SIGTERM, 8 s later SIGKILL) when the client and all
  // its sessions have been destroyed, and killed when this process ends in any way. It uses TLS
  // only if the flags give it a certificate. Throws kNotFound without the program and kUnavailable,
  // with the end of the server's log, when it does not start.
  static Client SpawnServer(const SpawnOptions& spawn = {}, const ConnectOptions& options = {});

  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  // HOST:PORT of the server.
  const std::string& address() const;

  v1::ServerInfo GetServerInfo() const;

  // The status from grpc.health.v1; an empty `service` means the whole server.
  Health CheckHealth(const std::string& service = "") const;

  // A new session, which the returned object owns: deleted with it.
  Session CreateSession(const SessionOptions& options = {}) const;

  // A session that exists already; the returned object does not own it. Throws kNotFound.
  Session AttachSession(const std::string& name) const;

  // All pages, with shortened names.
  std::vector<v1::Session> ListSessions() const;

 private:
  explicit Client(std::shared_ptr<Connection> connection);

  std::shared_ptr<Connection> connection_;
};

}  // namespace client
}  // namespace drape
