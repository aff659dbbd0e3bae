// Cloths that may touch themselves are stepped in lanes while nothing of them is expected to touch.
// They have the same bits as alone, with every instruction set of this machine: those that stay
// apart, those that leave the flight that was expected of them within a step, and those that touch.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "server/solver/cpu/cpu_backend.h"
#include "server/solver/cpu/side_by_side/group_step.h"
#include "tests/parity/lane_batches.h"
#include "tests/support/reports.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr uint32_t kColumns = 13, kSteps = 36, kCloths = 20;

// Held by its first row.
Scene Sheet() {
  std::vector<uint32_t> pins(kColumns);
  std::iota(pins.begin(), pins.end(), 0u);
  Scene scene = Grid(kColumns, 10, 0.6, 0.5, pins);
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.sleep_motion_m = 0;
  scene.parameters.self_collision =
      SelfCollision{.thickness_m = 0.004, .friction_static = 0.3, .friction_dynamic = 0.3};
  for (Eigen::Vector3d& p : scene.state.positions_m) p.y() = 0.01 * p.z();
  return scene;
}

// Four kinds: two hang and swing, the pins of one jump, and those of the last come together.
std::vector<Eigen::Vector3d> PinsOf(const Scene& scene, uint32_t cloth, uint32_t step) {
  std::vector<Eigen::Vector3d> targets;
  for (const uint32_t pin : scene.model->pins()) {
    Eigen::Vector3d place = scene.state.positions_m[pin];
    if (cloth % 4 == 2 && step % 12 >= 6) place.y() += 0.01 * (pin % 3);
    if (cloth % 4 == 3) place.x() = 0.3 + (place.x() - 0.3) * std::max(0.5, 1 - 0.03 * step);
    targets.push_back(place);
  }
  return targets;
}

struct Outcome {
  std::vector<std::string> bits;  // of each cloth after each step
  std::vector<StepReport> reports;
};

Outcome Play(const CpuBackendOptions& options, bool use_lanes,
             const std::vector<uint32_t>& cloths) {
  const auto backend = CreateCpuBackend(options, {.use_lanes = use_lanes});
  const Scene scene = Sheet();
  std::vector<StepItem> items;
  for (const uint32_t cloth : cloths) {
    Scene own = scene;
    own.parameters.gravity_m_per_s2 = {0.2 * cloth, -9.81 + 0.05 * cloth, 0.1};
    items.push_back({CreateCloth(*backend, own), {}});
  }
  Outcome outcome;
  std::vector<std::vector<Eigen::Vector3d>> targets(items.size());
  for (uint32_t step = 0; step < kSteps; ++step) {
    for (size_t k = 0; k < items.size(); ++k) {
      targets[k] = PinsOf(scene, cloths[k], step);
      items[k].pin_targets_m = targets[k];
      items[k].measure = step % 2 == 1;
      items[k].impulses = step % 5 == 0;
    }
    for (const StepReport& report : backend->Step(items).reports) {
      outcome.reports.push_back(report);
    }
    for (const StepItem& item : items) outcome.bits.push_back(ReadBits(*backend, item.cloth));
  }
  return outcome;
}

std::vector<uint32_t> AllCloths() {
  std::vector<uint32_t> all(kCloths);
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

// `alone` is of all cloths, `together` of these.
void ExpectSameBits(const Outcome& together, const std::vector<uint32_t>& cloths,
                    const Outcome& alone, const std::string& how) {
  for (size_t k = 0; k < together.bits.size(); ++k) {
    const size_t cloth = cloths[k % cloths.size()], step = k / cloths.size();
    const size_t place = step * kCloths + cloth;
    const std::string where =
        how + ", cloth " + std::to_string(cloth) + ", step " + std::to_string(step);
    ASSERT_TRUE(together.bits[k] == alone.bits[place]) << where;
    ASSERT_EQ(DifferenceOf(together.reports[k], alone.reports[place]), "") << where;
  }
}

TEST(SelfContactLanesTest, AreBitExact) {
  const std::vector<uint32_t> all = AllCloths();
  const Outcome alone = Play({.thread_count = 1}, false, all);
  size_t touching = 0, apart = 0;
  for (const StepReport& report : alone.reports) {
    (report.measured.near_pairs > 0 ? touching : apart) += 1;
  }
  EXPECT_GT(touching, 20u);
  EXPECT_GT(apart, 300u);
  uint32_t most_lanes = 1;
  for (const int64_t set : InstructionSets()) {
    const OnlyInstructionSet only(set);
    most_lanes = std::max(most_lanes, cpu::SupportedLanes().lane_count);
    ExpectSameBits(Play({.thread_count = 1}, true, all), all, alone, cpu::SupportedLanes().name);
  }
  EXPECT_GE(most_lanes, 4u) << "this machine has no lanes to test";
  ExpectSameBits(Play({.thread_count = 2}, true, all), all, alone, "two threads");
  // Other slots and other batch mates: those of two kinds, and from the last to the first.
  std::vector<uint32_t> some;
  for (uint32_t cloth = kCloths; cloth-- > 0;) {
    if (cloth % 4 == 1 || cloth % 4 == 2) some.push_back(cloth);
  }
  ExpectSameBits(Play({.thread_count = 2}, true, some), some, alone, "others");
}

}  // namespace
}  // namespace drape::test
