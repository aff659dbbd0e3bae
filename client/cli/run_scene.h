// Plays one scene to its end (or Ctrl-C), feeding report, state files and comparison.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "client/cli/comparison.h"
#include "client/cli/picture_sink.h"
#include "client/cli/report.h"
#include "client/cli/state_writers.h"
#include "drape/client.h"

namespace drape::cli {

struct RunSinks {
  std::vector<std::unique_ptr<StateWriter>> writers;
  std::unique_ptr<Comparison> comparison;  // may be null
  std::unique_ptr<PictureSink> pictures;   // may be null
  std::function<void(uint64_t)> on_step;   // after each sample, with the steps done
  // Called after each request; once it returns true, there is one more step and the last sample.
  std::function<bool()> should_stop;
  bool has_impulses = false;  // the report has them, where the server can tell
  bool has_contacts = false;  // pictures show them
  // Keeps the results so far when a run fails after its first sample; the error is rethrown.
  std::function<void(const RunReport&)> on_failure;
};

// `every` >= 1: takes a sample after every `every` steps, and after the last. Finishes the writers,
// also when it stops early. After an error it finishes only those that have samples and leaves the
// others as they are.
RunReport RunScene(const Client& client, const v1::Scene& scene, uint64_t every, RunSinks& sinks);

// One topology per cloth, copies counted, as state writers want them.
std::vector<Topology> SceneTopologies(const v1::Scene& scene);

}  // namespace drape::cli
