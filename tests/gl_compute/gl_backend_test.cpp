#include "server/solver/gl_compute/gl_backend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

// One device for all tests, as in the server.
class GlBackendTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { backend_ = MakeGlBackend().release(); }
  static void TearDownTestSuite() {
    delete backend_;
    backend_ = nullptr;
  }
  static Backend& backend() { return *backend_; }

 private:
  static inline Backend* backend_ = nullptr;
};

constexpr float kUlp = std::numeric_limits<float>::epsilon();

TEST_F(GlBackendTest, DescribesItself) {
  const BackendDescription description = backend().Describe();
  EXPECT_EQ(description.name, "gl");
  EXPECT_THAT(description.device, HasSubstr("OpenGL 4."));
  EXPECT_EQ(description.scalar, ScalarType::kFloat32);
  EXPECT_EQ(backend().PlanOf(*GridModel(32, 32)), "resident");
  EXPECT_EQ(backend().PlanOf(*GridModel(41, 25)), "tiled");
}

// The mean velocity form is exact for a constant acceleration, so only roundings remain: in one substep
// one of p + h u, one of u; 60 substeps add at most 60 half ulps to position and velocity each.
TEST_F(GlBackendTest, FreeFallIsExact) {
  for (const uint32_t particle_count : {1u, 2u, 3u, 31u, 33u, 1024u, 1025u, 5000u}) {
    ParticleTopology free;
    for (uint32_t i = 0; i < particle_count; ++i) {
      free.positions_m.push_back({0.001 * i, 0, 0});
      free.masses_kg.push_back(0.001 * (i + 1));
    }
    const auto model = BuildModel({.topology = free, .material = {}, .pinned_particles = {}});
    const ClothHandle cloth = CreateCloth(backend(), model);
    const StepReport report = StepCloth(backend(), cloth);
    EXPECT_EQ(report.fault, FaultReason::kNone);
    const std::vector<float> state = ReadCloth(backend(), cloth);
    ASSERT_EQ(state.size(), 6 * particle_count);
    const double t = 1.0 / 60;
    for (uint32_t i = 0; i < particle_count; ++i) {
      ASSERT_EQ(state[3 * i], static_cast<float>(0.001 * i));
      ASSERT_NEAR(state[3 * i + 1], -9.81 / 2 * t * t, 60 * kUlp * 9.81 / 2 * t * t);
      ASSERT_NEAR(state[3 * (particle_count + i) + 1], -9.81 * t, 60 * kUlp * 9.81 * t);
      ASSERT_EQ(state[3 * i + 2], 0);
    }
    backend().Destroy(cloth);
  }
}

// What the solver calls converged is within the tolerance, and pins stay where they are. The committed
// positions are p + h u rounded once more, which adds a few ulps of a coordinate of at most 1 m to an
// error relative to the rest length of 1/11 m.
TEST_F(GlBackendTest, HangingGridKeepsItsLengthsAndPins) {
  constexpr double kTolerance = 1e-2;
  constexpr double kRounding = 4 * kUlp * 11;
  const auto model = GridModel(12, 12, {0, 11});
  ClothParameters parameters;
  parameters.settings = PresetSettings(Preset::kAccurate);
  parameters.settings.substeps = 8;
  parameters.settings.tolerance = kTolerance;
  parameters.settings.max_iterations = 2000;
  const ClothHandle cloth = CreateCloth(backend(), model, parameters);
  for (int step = 0; step < 4; ++step) {
    const StepReport report = StepCloth(backend(), cloth, true);
    EXPECT_TRUE(report.converged);
    EXPECT_FALSE(report.warnings.tolerance_raised);
    EXPECT_GE(report.iterations, 8u);
    EXPECT_LE(report.measured.max_strain, kTolerance + kRounding);
    EXPECT_GT(report.measured.kinetic_energy_j, 0);
  }
  const std::vector<float> state = ReadCloth(backend(), cloth);
  for (const uint32_t pin : {0u, 11u}) {
    EXPECT_EQ(state[3 * pin], static_cast<float>(model->rest_positions_m()[pin].x()));
    EXPECT_EQ(state[3 * pin + 1], 0.0f);
    EXPECT_EQ(state[3 * pin + 2], 0.0f);
  }
  EXPECT_LT(state[3 * (12 * 12 - 1) + 1], -0.01f) << "the free corner falls";
  backend().Destroy(cloth);
}

TEST_F(GlBackendTest, DispatchCountDoesNotGrowWithTheClothCount) {
  for (const auto& [columns, rows] : {std::pair{8u, 8u}, std::pair{41u, 25u}}) {
    const auto model = GridModel(columns, rows, {0});
    ClothParameters parameters;
    parameters.settings.substeps = 2;
    std::vector<ClothHandle> cloths;
    std::vector<StepItem> items;
    for (int k = 0; k < 256; ++k) {
      parameters.gravity_m_per_s2.x() = 0.01 * k;  // no two cloths are equal
      cloths.push_back(CreateCloth(backend(), model, parameters));
      items.push_back({.cloth = cloths.back(), .pin_targets_m = {}, .measure = false});
    }
    const BatchReport one = backend().Step(std::span(items).first(1));
    const BatchReport all = backend().Step(items);
    EXPECT_GT(one.dispatch_count, 0u);
    EXPECT_EQ(one.dispatch_count, all.dispatch_count);
    EXPECT_EQ(all.reports.size(), 256u);
    if (columns == 8) {
      EXPECT_EQ(all.dispatch_count, 1u);
    }
    for (const ClothHandle cloth : cloths) backend().Destroy(cloth);
  }
}

}  // namespace
}  // namespace drape
