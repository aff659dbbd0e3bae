// The same scene on a second backend, and the difference of the two.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "drape/client.h"
#include "drape/scene_player.h"

namespace drape::cli {

// The largest distance between two particles that should be in the same place.
struct PositionDifference {
  double largest_m = 0;
  size_t cloth = 0;  // in scene order
  size_t particle = 0;
  uint64_t step = 0;
};

// Raises `difference` where the states differ by more, or by NaN. Throws kInternal when they are
// not of the same cloths and steps.
void Compare(const States& states, const States& others, PositionDifference* difference);

// A second private server that plays the same scene. One thread.
class Comparison {
 public:
  Comparison(const std::string& backend, const v1::Scene& scene);

  // Does as many steps as the first player did, and compares. Once `should_stop` returns true it
  // may do fewer (ScenePlayer::Advance); then there is nothing to compare.
  void Advance(uint64_t steps, const States& states,
               const std::function<bool()>& should_stop = nullptr);

  const std::string& backend() const { return backend_; }
  const PositionDifference& difference() const { return difference_; }
  // The last sample that was compared.
  uint64_t compared_steps() const { return compared_steps_; }

 private:
  const Client client_;
  Session session_;
  std::string backend_;
  ScenePlayer player_;
  PositionDifference difference_;
  uint64_t first_steps_ = 0;  // of the first player
  uint64_t compared_steps_ = 0;
};

}  // namespace drape::cli
