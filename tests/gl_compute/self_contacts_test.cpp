// Cloths that touch themselves: what their bits must not depend on, and lists that are too short.
#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/solver/gl_compute/gl_tuning.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using test::Scene;

constexpr uint32_t kSteps = 3;

std::unique_ptr<Backend> Device(const GlTuning& tuning = {}) {
  Result<std::unique_ptr<Backend>> backend = CreateTunedGlBackend({}, tuning);
  DRAPE_CHECK(backend.ok(), backend.status().ToString());
  return std::move(backend).value();
}

GlTuning WithLocalSize(uint32_t local_size) {
  GlTuning tuning;
  tuning.local_size = local_size;
  return tuning;
}

GlTuning WithFirstPairs(uint32_t per_particle) {
  GlTuning tuning;
  tuning.first_pairs_per_particle = per_particle;
  return tuning;
}

// Two layers that fly at each other and crumple: pairs, pushes of the guard, zones.
Scene Crumpling(double speed_m_per_s) {
  Scene scene = test::Grid(9, 6, 0.5, 0.3);
  StepSettings& settings = scene.parameters.settings;
  settings = PresetSettings(Preset::kRealtime);
  settings.substeps = 8;
  settings.sleep_motion_m = 0;
  scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
  scene.parameters.self_collision.emplace().thickness_m = 0.01;
  test::Stir(scene, 0.5);
  for (size_t i = 0; i < scene.state.positions_m.size(); ++i) {
    Vector3d& p = scene.state.positions_m[i];
    const bool is_upper = p.x() > 0.25;
    if (is_upper) p.x() = 0.5 - p.x();
    p.y() += is_upper ? 0.03 : 0.0;
    scene.state.velocities_m_per_s[i].y() += is_upper ? -speed_m_per_s : speed_m_per_s;
  }
  return scene;
}

std::string BitsAfter(Backend& backend, const Scene& scene) {
  const ClothHandle cloth = test::CreateCloth(backend, scene);
  for (uint32_t step = 0; step < kSteps; ++step) {
    const StepReport report = test::StepAlone(backend, cloth, scene, 1, true);
    EXPECT_EQ(report.fault, FaultReason::kNone);
    EXPECT_EQ(report.measured.crossings, 0u) << "step " << step;
    EXPECT_GT(report.measured.near_pairs, 0u) << "step " << step;
  }
  const std::string bits = test::ReadBits(backend, cloth);
  backend.Destroy(cloth);
  return bits;
}

TEST(SelfContactsTest, NoBitDependsOnTheLocalSize) {
  const Scene scene = Crumpling(5);
  const std::string expected = BitsAfter(*Device(), scene);
  EXPECT_EQ(BitsAfter(*Device(WithLocalSize(64)), scene), expected);
}

TEST(SelfContactsTest, NoBitDependsOnTheBatch) {
  const std::vector<Scene> scenes = {Crumpling(1), Crumpling(5), Crumpling(20)};
  const std::unique_ptr<Backend> backend = Device();
  std::vector<std::string> alone;
  for (const Scene& scene : scenes) alone.push_back(BitsAfter(*backend, scene));
  for (const std::vector<size_t>& order : {std::vector<size_t>{2, 0, 1}, {1, 2}}) {
    std::vector<ClothHandle> cloths;
    std::vector<StepItem> items;
    for (const size_t k : order) {
      cloths.push_back(test::CreateCloth(*backend, scenes[k]));
      items.emplace_back().cloth = cloths.back();
    }
    for (uint32_t step = 0; step < kSteps; ++step) backend->Step(items);
    for (size_t place = 0; place < order.size(); ++place) {
      EXPECT_EQ(test::ReadBits(*backend, cloths[place]), alone[order[place]]) << order[place];
    }
    for (const ClothHandle cloth : cloths) backend->Destroy(cloth);
  }
}

// The step is done again with more room.
TEST(SelfContactsTest, ListsThatAreTooShortGrow) {
  const Scene scene = Crumpling(5);
  const auto dispatches = [&](Backend& backend) {
    const ClothHandle cloth = test::CreateCloth(backend, scene);
    std::vector<StepItem> items(1);
    items[0].cloth = cloth;
    const uint32_t first = backend.Step(items).dispatch_count;
    EXPECT_LE(backend.Step(items).dispatch_count, first);
    backend.Destroy(cloth);
    return first;
  };
  const std::unique_ptr<Backend> tight = Device(WithFirstPairs(1));
  const std::unique_ptr<Backend> ample = Device(WithFirstPairs(kMostPairsPerParticle));
  EXPECT_GT(dispatches(*tight), dispatches(*ample));
  EXPECT_EQ(BitsAfter(*tight, scene), BitsAfter(*ample, scene));
}

}  // namespace
}  // namespace drape
