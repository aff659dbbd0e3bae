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
  StepReport report;
};
// A few steps, the last one measured, with the impulses of the first one.
std::vector<LaneOutcome> StepTogether(Backend& backend, const std::vector<Scene>& scenes);
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
