// The certificates that a server was told to use.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "server/core/status.h"

namespace drape::api {

// PEM files, read again while the server runs: renewed ones are used for new connections.
struct TlsFiles {
  std::string certificate = {};  // the chain; with a key, or neither: no encryption
  std::string key = {};
  // Authorities of the clients' certificates; empty: clients need none.
  std::string client_authorities = {};

  bool is_on() const { return !certificate.empty() || !key.empty(); }
};

// FAILED_PRECONDITION (TLS_FILE_FAILED) names a file that cannot be read or holds no certificate or
// key, or a key that is not the certificate's: a server that was told to encrypt never serves in
// the clear, nor refuses everybody.
Status CheckTlsFiles(const TlsFiles& files);

// Looks at the files of a server that runs: gRPC uses what is there, good or not. One thread.
class TlsWatch {
 public:
  // Of files that are good.
  explicit TlsWatch(TlsFiles files) : files_(std::move(files)) {}

  // What CheckTlsFiles says now, if it says something else than before.
  std::optional<Status> Look();

 private:
  const TlsFiles files_;
  Status last_;
};

}  // namespace drape::api
