// The viewers of `drape load`: they follow the sessions of clients while those step.
#pragma once

#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "client/cli/load_run.h"

namespace drape::cli {

// Viewers of one window: they begin here and end with StopAndAdd or the destructor. Viewer k
// follows client k modulo their number, over a connection of its own.
class LoadViewers {
 public:
  LoadViewers(const LoadPlan& plan, std::span<const std::unique_ptr<LoadClient>> clients);
  ~LoadViewers();
  LoadViewers(const LoadViewers&) = delete;
  LoadViewers& operator=(const LoadViewers&) = delete;

  // Ends them and adds what they have seen.
  void StopAndAdd(LoadSamples& samples);

 private:
  struct Viewer;

  void Stop();

  std::vector<std::unique_ptr<Viewer>> viewers_;
};

}  // namespace drape::cli
