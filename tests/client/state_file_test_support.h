// The states that the tests of state writers write: two cloths, one with a triangle and one with a
// line.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/state_writers.h"
#include "tests/client/client_test_support.h"

namespace drape::client_test {

inline constexpr float kThird = 1.0f / 3;

// A cloth of three particles, with a triangle, and one of two, with a line.
inline States TwoCloths(uint64_t step) {
  std::vector<float> positions(15);
  std::iota(positions.begin(), positions.end(), static_cast<float>(step));
  positions[4] = kThird;
  std::vector<float> velocities(15, 0.5f);
  velocities[14] = -1e-20f;
  return MakeStates({3, 2}, step, positions, velocities);
}

inline std::vector<cli::Topology> TwoTopologies() {
  cli::Topology triangle;
  triangle.triangles = {{0, 1, 2}};
  cli::Topology line;
  line.lines = {{0, 1}};
  return {triangle, line};
}

class StateFileTest : public ::testing::Test {
 protected:
  // The file after samples at steps 1 and 2, or of step 2 alone for geometry.
  std::filesystem::path Written(const std::string& name) {
    const auto path = folder_ / name;
    const auto writer = cli::MakeStateWriter(path, {TwoTopologies(), /*time_step_s=*/0.1});
    if (writer->takes_samples()) writer->Add(TwoCloths(1));
    writer->Add(TwoCloths(2));
    writer->Finish();
    return path;
  }
  TemporaryFolder folder_;
};

}  // namespace drape::client_test
