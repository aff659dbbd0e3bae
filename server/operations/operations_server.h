// The HTTP port for monitoring.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/core/status.h"
#include "server/operations/metrics.h"

namespace drape {

class OperationsServer {
 public:
  // `listen`: HOST:PORT, port 0 = any free one; HOST is an IP address or localhost. `numbers` is
  // called for each look at /metrics, on a thread of this server. FAILED_PRECONDITION
  // (METRICS_LISTEN_FAILED).
  static Result<std::unique_ptr<OperationsServer>> Start(const std::string& listen,
                                                         std::function<ServerNumbers()> numbers);
  // Waits for answers under way.
  ~OperationsServer();

  int port() const;
  // The answer of /readyz; not ready after the start.
  void SetReady(bool is_ready);

 private:
  struct Impl;
  explicit OperationsServer(std::unique_ptr<Impl> impl);

  const std::unique_ptr<Impl> impl_;
};

}  // namespace drape
