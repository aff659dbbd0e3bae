// The certificates that a server was told to use.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/core/status.h"

namespace drape::api {

// PEM files.
struct TlsFiles {
  std::string certificate = {};  // the chain; with a key, or neither: no encryption
  std::string key = {};
  // Authorities of the clients' certificates; empty: clients need none.
  std::string client_authorities = {};

  bool is_on() const { return !certificate.empty() || !key.empty(); }
};

// A file in memory. Who opens it gets a whole content, the old one or the new one.
class MemoryFile {
 public:
  MemoryFile() = default;
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  // RESOURCE_EXHAUSTED: the content is what it was.
  Status Replace(const std::string& content);
  // For this process; empty before there is any content.
  std::string path() const;

 private:
  std::string content_;
  int descriptor_ = -1;
};

// What a server that runs uses of its files: gRPC watches copies in memory, which change only to
// what is good, a certificate together with its key. While one of them is renewed and the other one
// not yet, the old pair stays in use.
class TlsInUse {
 public:
  // Of files that are on. FAILED_PRECONDITION (TLS_FILE_FAILED) names one that cannot be read, or
  // in which what it is for is missing or damaged, or a key that is not the certificate's: a server
  // that was told to encrypt never serves in the clear, nor refuses everybody.
  static Result<std::shared_ptr<TlsInUse>> Open(TlsFiles files);

  // The chain and its key are one file.
  TlsFiles copies() const;
  // Takes what has changed, if it is good; what Open would say now, if that is something else than
  // before. One thread at a time.
  std::optional<Status> Look();

 private:
  explicit TlsInUse(TlsFiles files) : files_(std::move(files)) {}

  Status TakeFiles();

  const TlsFiles files_;
  MemoryFile pair_, authorities_;
  Status last_;
};

}  // namespace drape::api
