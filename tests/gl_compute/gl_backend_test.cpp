#include "server/solver/gl_compute/gl_backend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "server/gl/device_copy.h"
#include "server/solver/device_backend.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/plain_settings.h"

namespace drape {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

// An update of which `set` fills in some members.
template <class Set>
ClothUpdate Update(Set set) {
  ClothUpdate update;
  set(update);
  return update;
}

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
  EXPECT_EQ(backend().Describe().plan_of(*GridModel(32, 32), {}), "resident");
  EXPECT_EQ(backend().Describe().plan_of(*GridModel(41, 25), {}), "tiled");
}

// The mean velocity form is exact for a constant acceleration, so only roundings remain: in one
// substep one of p + h u, one of u; 60 substeps add at most 60 half ulps to position and velocity
// each.
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

// Cloths that the solver calls converged are within the tolerance, and pins stay where they are.
// The committed positions are p + h u rounded once more, which adds a few ulps of a coordinate of
// at most 1 m to an error relative to the rest length of 1/11 m.
TEST_F(GlBackendTest, HangingGridKeepsItsLengthsAndPins) {
  constexpr double kTolerance = 1e-2;
  constexpr double kRounding = 4 * kUlp * 11;
  const auto model = GridModel(12, 12, {0, 11});
  ClothParameters parameters = test::PlainParameters();
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
    ClothParameters parameters = test::PlainParameters();
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

TEST_F(GlBackendTest, EmptyBatchDispatchesNothing) {
  const BatchReport report = backend().Step({});
  EXPECT_TRUE(report.reports.empty());
  EXPECT_EQ(report.dispatch_count, 0u);
}

TEST_F(GlBackendTest, DeviceTimeIsMeasured) {
  const ClothHandle cloth = CreateCloth(backend(), GridModel(32, 32, {0}));
  StepCloth(backend(), cloth);
  const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
  const BatchReport report = backend().Step(std::span(&item, 1));
  // 60 substeps of 1984 constraints: far more than a microsecond on any device.
  EXPECT_GT(report.device_us, 1);
  EXPECT_GE(report.upload_us, 0);
  EXPECT_GE(report.readback_us, 0);
  backend().Destroy(cloth);
}

// A grid with every feature of the kernels.
ClothParameters EverythingParameters(SpringIntegration integration, double tolerance) {
  ClothParameters parameters = test::PlainParameters();
  parameters.damping_per_s = 0.5;
  parameters.friction_static = 0.5;
  parameters.friction_dynamic = 0.4;
  parameters.thickness_m = 0.002;
  parameters.colliders = {SphereAt({0.5, -0.1, 0.5}, 0.09), PlaneThrough({0, -0.15, 0}, {0, 1, 0})};
  parameters.settings.time_step_s = 1.0 / 30;
  parameters.settings.substeps = 6;
  parameters.settings.max_iterations = 12;
  parameters.settings.tolerance = tolerance;
  parameters.settings.spring_integration = integration;
  return parameters;
}

std::shared_ptr<const SceneModel> EverythingModel(uint32_t columns, uint32_t rows) {
  ModelDescription description = GridDescription(columns, rows, {0});
  description.material.stretch_compliance_m_per_n = 1e-5;
  description.material.bending_stiffness_n_per_m = 0.5;
  description.material.shear_stiffness_n_per_m = 0.5;
  return BuildModel(description);
}

std::vector<float> StatesAfter(Backend& backend, const std::shared_ptr<const SceneModel>& model,
                               const ClothParameters& parameters, int steps,
                               uint32_t* dispatch_count = nullptr) {
  const ClothHandle cloth = CreateCloth(backend, model, parameters);
  const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = false};
  for (int step = 0; step < steps; ++step) {
    const BatchReport report = backend.Step(std::span(&item, 1));
    if (dispatch_count != nullptr) *dispatch_count = report.dispatch_count;
  }
  std::vector<float> state = ReadCloth(backend, cloth);
  backend.Destroy(cloth);
  return state;
}

// The result does not depend on how the work is spread over invocations and dispatches.
TEST_F(GlBackendTest, LocalSizeAndPartsDoNotChangeBits) {
  std::vector<std::unique_ptr<Backend>> others;
  for (const uint32_t local_size : {8u, 64u}) {
    others.push_back(MakeGlBackend({.local_size = local_size}));
  }
  const std::unique_ptr<Backend> in_parts = MakeGlBackend({.loop_budget = 1500});
  struct Case {
    uint32_t columns;
    SpringIntegration integration;
    double tolerance;
  };
  for (const Case& c : {Case{9, SpringIntegration::kHalfKicks, 1e-3},
                        Case{35, SpringIntegration::kHalfKicks, 1e-3}}) {
    const auto model = EverythingModel(c.columns, c.columns);
    const ClothParameters parameters = EverythingParameters(c.integration, c.tolerance);
    const std::vector<float> expected = StatesAfter(backend(), model, parameters, 5);
    for (const auto& other : others) {
      EXPECT_EQ(StatesAfter(*other, model, parameters, 5), expected);
    }
    if (c.columns > 32) continue;  // the tiled plan has no parts
    uint32_t dispatch_count = 0;
    EXPECT_EQ(StatesAfter(*in_parts, model, parameters, 5, &dispatch_count), expected);
    EXPECT_GT(dispatch_count, 1u);
  }
}

// llvmpipe leaves every loop after 65535 passes in one invocation: such steps run in parts.
TEST_F(GlBackendTest, LongStepsAreNotCutShort) {
  const auto model = EverythingModel(32, 32);
  ClothParameters parameters = EverythingParameters(SpringIntegration::kHalfKicks, 0);
  parameters.settings.substeps = 20;
  parameters.settings.max_iterations = 50;
  const ClothHandle cloth = CreateCloth(backend(), model, parameters);
  EXPECT_EQ(StepCloth(backend(), cloth).iterations, 20u * 50u);
  backend().Destroy(cloth);
}

// A cloth twice as fast as the limit, under both plans.
TEST_F(GlBackendTest, FaultKeepsTheLastGoodStateAndItsNeighbours) {
  for (const auto& [columns, rows] : {std::pair{5u, 5u}, std::pair{40u, 40u}}) {
    const auto model = GridModel(columns, rows);
    const ClothHandle good = CreateCloth(backend(), model);
    ParticleState wild = AtRest(*model);
    for (Vector3d& v : wild.velocities_m_per_s) v = {0, 2e5, 0};
    const ClothHandle bad = CreateCloth(backend(), model, test::PlainParameters(), wild);
    const std::vector<float> before = ReadCloth(backend(), bad);
    const std::vector<StepItem> items = {{.cloth = good, .pin_targets_m = {}, .measure = false},
                                         {.cloth = bad, .pin_targets_m = {}, .measure = true}};
    for (int step = 0; step < 2; ++step) {
      const BatchReport report = backend().Step(items);
      EXPECT_EQ(report.reports[0].fault, FaultReason::kNone);
      EXPECT_EQ(report.reports[1].fault, FaultReason::kRunaway);
      EXPECT_TRUE(std::isfinite(report.reports[1].measured.kinetic_energy_j));
      EXPECT_EQ(ReadCloth(backend(), bad), before);
    }
    const ClothHandle alone = CreateCloth(backend(), model);
    StepCloth(backend(), alone);
    StepCloth(backend(), alone);
    EXPECT_EQ(ReadCloth(backend(), good), ReadCloth(backend(), alone));

    ASSERT_TRUE(
        backend().Write(bad, Update([&](auto& update) { update.state = AtRest(*model); })).ok());
    EXPECT_EQ(StepCloth(backend(), bad).fault, FaultReason::kNone);
    for (const ClothHandle cloth : {good, bad, alone}) backend().Destroy(cloth);
  }
}

TEST_F(GlBackendTest, NotFiniteIsTold) {
  const auto model = GridModel(5, 5);
  ParticleState state = AtRest(*model);
  state.velocities_m_per_s[7] = {std::numeric_limits<double>::quiet_NaN(), 0, 0};
  const ClothHandle cloth = CreateCloth(backend(), model, test::PlainParameters(), state);
  EXPECT_EQ(StepCloth(backend(), cloth).fault, FaultReason::kNotFinite);
  backend().Destroy(cloth);
}

TEST_F(GlBackendTest, PinTargetsStayUntilNewOnesCome) {
  for (const uint32_t count : {5u, 1500u}) {
    const auto model = BuildModel(ChainDescription(count, {0, 2}));
    ClothParameters parameters = test::PlainParameters();
    parameters.settings.substeps = 4;
    const ClothHandle cloth = CreateCloth(backend(), model, parameters);
    const std::vector<Vector3d> targets = {{0.125, 0.25, 0.5}, {0.15625, 0.25, 0.5}};
    const StepItem moved{.cloth = cloth, .pin_targets_m = targets, .measure = false};
    backend().Step(std::span(&moved, 1));
    StepCloth(backend(), cloth);
    std::vector<float> state = ReadCloth(backend(), cloth);
    EXPECT_EQ(state[0], 0.125f);
    EXPECT_EQ(state[1], 0.25f);
    EXPECT_EQ(state[6], 0.15625f);
    EXPECT_EQ(state[3 * count + 1], 0.0f) << "a pin at its target has no velocity";

    // Particle 2 keeps its target, particle 1 is pinned where it is, particle 0 is free.
    const float before_y = state[4];
    const auto other = BuildModel(ChainDescription(count, {1, 2}));
    ASSERT_TRUE(backend().Write(cloth, Update([&](auto& update) { update.model = other; })).ok());
    StepCloth(backend(), cloth);
    state = ReadCloth(backend(), cloth);
    EXPECT_EQ(state[4], before_y);
    EXPECT_EQ(state[6], 0.15625f);
    EXPECT_NE(state[1], 0.25f);
    backend().Destroy(cloth);
  }
}

TEST_F(GlBackendTest, WriteChangesOnlyWhatIsSet) {
  const auto model = GridModel(6, 6, {0});
  const ClothHandle cloth = CreateCloth(backend(), model);
  StepCloth(backend(), cloth);
  const std::vector<float> state = ReadCloth(backend(), cloth);
  ClothParameters still = test::PlainParameters();
  still.gravity_m_per_s2 = {0, 0, 0};
  ASSERT_TRUE(
      backend().Write(cloth, Update([&](auto& update) { update.parameters = still; })).ok());
  EXPECT_EQ(ReadCloth(backend(), cloth), state);
  const std::vector<Vector3d> target = {{0, 0.5, 0}};
  const ClothUpdate moved = Update([&](auto& update) {
    update.state = AtRest(*model);
    update.pin_targets_m = target;
  });
  ASSERT_TRUE(backend().Write(cloth, moved).ok());
  StepCloth(backend(), cloth);
  EXPECT_EQ(ReadCloth(backend(), cloth)[1], 0.5f);
  backend().Destroy(cloth);
}

// Many cloths make every array grow several times.
TEST_F(GlBackendTest, CopiesOnTheDeviceAreWhatIsReadAndStaySo) {
  const ClothHandle one = CreateCloth(backend(), GridModel(5, 4));
  const ClothHandle other = CreateCloth(backend(), GridModel(3, 3));
  StepCloth(backend(), one);
  StepCloth(backend(), other);
  const ClothHandle both[] = {other, one};
  const auto read_back = [](const DeviceCopy& copy) {
    std::vector<float> words(copy.buffer.size_bytes() / sizeof(float));
    copy.buffer.Download(0, std::as_writable_bytes(std::span(words)));
    return words;
  };
  const auto columns = [&](const ReadRequest& request) {
    const StateColumns read = backend().Read(request);
    std::vector<float> words = std::get<std::vector<float>>(read.positions_m);
    const auto& velocities = std::get<std::vector<float>>(read.velocities_m_per_s);
    words.insert(words.end(), velocities.begin(), velocities.end());
    return words;
  };
  for (const auto& [positions, velocities] : {std::pair(true, true), std::pair(true, false)}) {
    const ReadRequest request{both, positions, velocities};
    const std::vector<float> expected = columns(request);
    const std::shared_ptr<DeviceCopy> copy = backend().device()->CopyOnDevice(request);
    ASSERT_NE(copy, nullptr);
    EXPECT_EQ(read_back(*copy), expected);
    StepCloth(backend(), one);
    EXPECT_EQ(read_back(*copy), expected);
  }
  EXPECT_EQ(backend().device()->CopyOnDevice({{}, true, true}), nullptr);
  backend().Destroy(one);
  backend().Destroy(other);
}

TEST_F(GlBackendTest, GrowingArraysKeepStates) {
  const std::unique_ptr<Backend> fresh = MakeGlBackend();
  const auto model = GridModel(10, 10, {0});
  ClothParameters parameters = test::PlainParameters();
  parameters.colliders = {PlaneThrough({0, -1, 0}, {0, 1, 0})};
  std::vector<ClothHandle> cloths;
  for (int k = 0; k < 300; ++k) {
    ParticleState state = AtRest(*model);
    state.positions_m[7].y() = k;
    cloths.push_back(CreateCloth(*fresh, model, parameters, state));
  }
  const StateColumns columns = fresh->Read({cloths, true, false});
  const auto& positions = std::get<std::vector<float>>(columns.positions_m);
  ASSERT_EQ(positions.size(), 300u * 300u);
  for (size_t k = 0; k < 300; ++k) ASSERT_EQ(positions[300 * k + 3 * 7 + 1], static_cast<float>(k));
  EXPECT_TRUE(std::get<std::vector<float>>(columns.velocities_m_per_s).empty());
}

TEST_F(GlBackendTest, FullDeviceRefusesAndKeepsWhatItHas) {
  const std::unique_ptr<Backend> small = MakeGlBackend({.max_array_bytes = 128 * 1024});
  const auto model = GridModel(30, 30, {0});  // 21600 bytes of state
  ClothParameters plain = test::PlainParameters();
  plain.settings.sweep = Sweep::kColours;
  std::vector<ClothHandle> cloths;
  Status refusal;
  while (refusal.ok()) {
    Result<ClothHandle> cloth = small->Create(model, plain, AtRest(*model));
    if (cloth.ok()) cloths.push_back(cloth.value());
    refusal = cloth.status();
    ASSERT_LE(cloths.size(), 6u);
  }
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal.reason(), "DEVICE_MEMORY");
  EXPECT_THAT(refusal.message(), HasSubstr("131072"));
  ASSERT_EQ(cloths.size(), 6u);
  for (const ClothHandle cloth : cloths) {
    EXPECT_EQ(StepCloth(*small, cloth).fault, FaultReason::kNone);
  }
  // Colliders need room too, and a refused update changes nothing.
  ClothParameters crowded = test::PlainParameters();
  crowded.colliders.assign(100, SphereAt({0, 0, 0}, 0.1));
  const std::vector<float> before = ReadCloth(*small, cloths[0]);
  const ClothUpdate too_much = Update([&](auto& update) {
    update.parameters = crowded;
    update.state = AtRest(*model);
  });
  EXPECT_EQ(small->Write(cloths[0], too_much).code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(ReadCloth(*small, cloths[0]), before);
  // Room that is given back is used again.
  small->Destroy(cloths.back());
  EXPECT_TRUE(small->Create(model, test::PlainParameters(), AtRest(*model)).ok());
}

TEST_F(GlBackendTest, TooManySpringsAtOneParticleAreRefused) {
  const std::unique_ptr<Backend> short_loops = MakeGlBackend({.loop_budget = 900});
  ParticleTopology star;
  for (uint32_t i = 0; i < 1001; ++i) {
    star.positions_m.push_back({0.01 * i, 0, 0});
    star.masses_kg.push_back(0.01);
    if (i > 0) star.springs.push_back({0, i, 0.01, 1, 0});
  }
  const auto model = BuildModel({.topology = star, .material = {}, .pinned_particles = {}});
  const Result<ClothHandle> cloth =
      short_loops->Create(model, test::PlainParameters(), AtRest(*model));
  ASSERT_FALSE(cloth.ok());
  EXPECT_EQ(cloth.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(cloth.status().reason(), "KERNEL_LOOP_LIMIT");
  const Result<ClothHandle> on_full_budget =
      backend().Create(model, test::PlainParameters(), AtRest(*model));
  ASSERT_TRUE(on_full_budget.ok()) << on_full_budget.status().ToString();
  backend().Destroy(on_full_budget.value());
}

TEST_F(GlBackendTest, TiledClothsStopSweepingOnceConverged) {
  const auto model = GridModel(41, 25, {0, 40});
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kOneStep;
  parameters.settings.substeps = 10;
  parameters.settings.max_iterations = 50;
  parameters.settings.tolerance = 0.02;
  const ClothHandle cloth = CreateCloth(backend(), model, parameters);
  ClothParameters weightless = parameters;
  weightless.gravity_m_per_s2 = {0, 0, 0};
  const ClothHandle resting = CreateCloth(backend(), model, weightless);
  const std::vector<StepItem> items = {{.cloth = cloth, .pin_targets_m = {}, .measure = true},
                                       {.cloth = resting, .pin_targets_m = {}, .measure = true}};
  uint32_t iterations = 0;
  for (int step = 0; step < 4; ++step) {
    const BatchReport report = backend().Step(items);
    EXPECT_TRUE(report.reports[0].converged);
    EXPECT_LE(report.reports[0].measured.max_strain, 0.02 + 1e-4);
    EXPECT_EQ(report.reports[1].iterations, 10u) << "one sweep per substep finds nothing to do";
    iterations = report.reports[0].iterations;
  }
  EXPECT_GT(iterations, 10u);
  EXPECT_LT(iterations, 500u);
  backend().Destroy(cloth);
  backend().Destroy(resting);
}

TEST(CreateGlBackendTest, NoDeviceIsAClearError) {
  const Result<std::unique_ptr<Backend>> backend =
      CreateGlBackend({.device_filter = [](const gl::EglDevice&) { return false; }});
  ASSERT_FALSE(backend.ok());
  EXPECT_EQ(backend.status().reason(), "NO_EGL_DEVICE");
}

TEST(CreateGlBackendTest, BrokenShaderInADirectoryIsToldWithFileAndLine) {
  const std::filesystem::path directory =
      std::filesystem::path(testing::TempDir()) / "drape_gl_backend_test";
  std::filesystem::create_directories(directory / "kernels");
  std::ofstream(directory / "kernels" / "pack.comp") << "layout(local_size_x = 1) in;\n"
                                                        "void main() {\n"
                                                        "  broken = 1;\n"
                                                        "}\n";
  const Result<std::unique_ptr<Backend>> backend =
      CreateGlBackend({.shader_dir = directory.string()});
  std::filesystem::remove_all(directory);
  ASSERT_FALSE(backend.ok());
  EXPECT_EQ(backend.status().reason(), "SHADER_COMPILE_FAILED");
  EXPECT_THAT(backend.status().message(), HasSubstr("kernels/pack.comp:3"));
}

TEST(CreateGlBackendTest, MissingShaderDirectoryIsNotFound) {
  const Result<std::unique_ptr<Backend>> backend =
      CreateGlBackend({.shader_dir = "/no/such/directory"});
  ASSERT_FALSE(backend.ok());
  EXPECT_EQ(backend.status().reason(), "SHADER_DIR_NOT_FOUND");
}

}  // namespace
}  // namespace drape
