// Batches of cloths of the cpu backend that may share lanes, stepped and compared.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/solver/backend.h"
#include "tests/support/scenes.h"

namespace drape::test {

// One of several cloths of a scene that differ in gravity, damping, pin targets, colliders and
// velocities. The fourth blows up; the sixth is stirred so much that its strips are limited.
Scene Variant(Scene scene, uint32_t index);

struct LaneOutcome {
  std::string bits;
  std::vector<StepReport> reports;  // of each step

  const StepReport& report() const { return reports.back(); }
};
// A few measured steps, each with the impulses of most of the cloths. `first`: which one of all
// cloths that are compared the first scene is.
std::vector<LaneOutcome> StepTogether(Backend& backend, const std::vector<Scene>& scenes,
                                      size_t first = 0);
void ExpectSame(const LaneOutcome& actual, const LaneOutcome& expected, const std::string& where);

// The instruction sets that highway compiles for and this machine has.
std::vector<int64_t> InstructionSets();

// Vectors of one instruction set, while it lives.
class OnlyInstructionSet {
 public:
  explicit OnlyInstructionSet(int64_t set);
  ~OnlyInstructionSet();
  OnlyInstructionSet(const OnlyInstructionSet&) = delete;
  OnlyInstructionSet& operator=(const OnlyInstructionSet&) = delete;
};

}  // namespace drape::test
