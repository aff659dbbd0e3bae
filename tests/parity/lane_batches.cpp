#include "tests/parity/lane_batches.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <memory>
#include <variant>

#include "tests/support/reports.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

constexpr size_t kSteps = 2;

// Its velocity.
Eigen::Vector3d& FirstFree(Scene& scene) {
  size_t i = 0;
  while (scene.model->inverse_masses_per_kg()[i] == 0) ++i;
  return scene.state.velocities_m_per_s[i];
}

// So that no lane has the numbers of another one.
void Shift(Collider& collider, double way_m) {
  collider.pose.position_m.y() += way_m;
  collider.pose.rotation =
      Eigen::AngleAxisd(way_m, Eigen::Vector3d(0.6, 0, 0.8)) * collider.pose.rotation;
  if (auto* box = std::get_if<BoxShape>(&collider.shape)) box->half_extents_m.y() += way_m;
}

}  // namespace

Scene Variant(Scene scene, uint32_t index) {
  const double x = index + 1;
  scene.parameters.gravity_m_per_s2 = {0.3 * std::sin(x), -9.81 + 0.1 * std::cos(x), 0.2 * x / 33};
  scene.parameters.friction_static *= 1 + index % 4;
  if (index % 6 == 1) scene.parameters.friction_static = scene.parameters.friction_dynamic = 0;
  if (index % 6 == 2) scene.parameters.restitution = 0;
  scene.parameters.wind_m_per_s *= 1 + 0.1 * x;
  if (scene.parameters.air_drag > 0) scene.parameters.air_lift = index % 3;
  for (Collider& collider : scene.parameters.colliders) {
    Shift(collider, 0.0005 * x);
  }
  scene.parameters.damping_per_s = index % 3 == 0 ? 0 : 0.1 * x;
  for (const uint32_t pin : scene.model->pins()) {
    const Eigen::Vector3d way{0.002 * std::cos(x), 0.001 * x / 33, -0.0005};
    scene.pin_targets_m.push_back(scene.state.positions_m[pin] + way);
  }
  Stir(scene, index % 5 == 0 ? 0.001 : 0.1 * (index % 7));
  if (index % 16 == 5) Stir(scene, 200);
  if (index % 16 == 3) FirstFree(scene).x() = 1e30;
  return scene;
}

std::vector<LaneOutcome> StepTogether(Backend& backend, const std::vector<Scene>& scenes,
                                      size_t first) {
  std::vector<StepItem> items;
  for (const Scene& scene : scenes) {
    items.push_back({.cloth = CreateCloth(backend, scene),
                     .pin_targets_m = scene.pin_targets_m,
                     .measure = true,
                     .grips = scene.grips});
  }
  std::vector<LaneOutcome> outcomes(scenes.size());
  for (size_t step = 0; step < kSteps; ++step) {
    for (size_t k = 0; k < items.size(); ++k) {
      items[k].impulses = (first + k + step) % 3 != 1;
      items[k].contact_impulses = (first + k + step) % 4 < 2;
    }
    const BatchReport batch = backend.Step(items);
    for (size_t k = 0; k < items.size(); ++k) {
      const StepReport& report = batch.reports[k];
      outcomes[k].reports.push_back(report);
      EXPECT_EQ(report.impulses != nullptr, items[k].impulses && report.fault == FaultReason::kNone)
          << "cloth " << first + k;
    }
  }
  for (size_t k = 0; k < items.size(); ++k) {
    outcomes[k].bits = ReadBits(backend, items[k].cloth);
    backend.Destroy(items[k].cloth);
  }
  return outcomes;
}

void ExpectSame(const LaneOutcome& actual, const LaneOutcome& expected, const std::string& where) {
  EXPECT_TRUE(actual.bits == expected.bits) << where;
  for (size_t step = 0; step < kSteps; ++step) {
    StepReport report = actual.reports[step];
    // How many sweeps were in vain of a step that has left the numbers depends on its lanes.
    if (report.fault != FaultReason::kNone) report.iterations = expected.reports[step].iterations;
    EXPECT_EQ(DifferenceOf(report, expected.reports[step]), "") << where << ", step " << step;
  }
}

std::vector<int64_t> InstructionSets() {
  hwy::SetSupportedTargetsForTest(0);
  std::vector<int64_t> sets;
  for (int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1) {
    sets.push_back(rest & -rest);
  }
  return sets;
}

namespace {

void Choose(int64_t set) {
  hwy::SetSupportedTargetsForTest(set);
  hwy::GetChosenTarget().DeInit();
}

}  // namespace

OnlyInstructionSet::OnlyInstructionSet(int64_t set) {
  Choose(set);
}
OnlyInstructionSet::~OnlyInstructionSet() {
  Choose(0);
}

}  // namespace drape::test
