#include "server/solver/cpu/cpu_backend.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape {
namespace {

using test::CreateCloth;
using test::ReadState;
using test::StepAlone;

TEST(CpuBackendTest, DescribesItself) {
  const auto backend = CreateCpuBackend({3});
  const BackendDescription description = backend->Describe();
  EXPECT_EQ(description.name, "cpu");
  EXPECT_EQ(description.scalar, ScalarType::kFloat32);
  EXPECT_FALSE(description.is_hardware_gpu);
  EXPECT_TRUE(description.device.starts_with("3 cores, ")) << description.device;
  EXPECT_EQ(CreateCpuBackend({}, {.use_lanes = false})
                ->Describe()
                .plan_of(*test::SizedCloth(33).model, {}),
            "single");
#if defined(__x86_64__)
  EXPECT_TRUE(description.device.find(" lanes (") != std::string::npos) << description.device;
  EXPECT_EQ(backend->Describe().plan_of(*test::SizedCloth(33).model, {}), "lanes");
#endif
}

TEST(CpuBackendTest, HandlesAreNotIssuedTwice) {
  const auto backend = CreateCpuBackend();
  const test::Scene scene = test::SizedCloth(3);
  const ClothHandle first = CreateCloth(*backend, scene);
  backend->Destroy(first);
  const ClothHandle second = CreateCloth(*backend, scene);
  EXPECT_NE(first, second);
  EXPECT_NE(second.generation, 0u);
}

TEST(CpuBackendDeathTest, AStaleHandleIsAProgrammerError) {
  const auto backend = CreateCpuBackend({1});
  const ClothHandle cloth = CreateCloth(*backend, test::SizedCloth(3));
  backend->Destroy(cloth);
  EXPECT_DEATH(backend->Destroy(cloth), "no cloth has this handle");
}

TEST(CpuBackendTest, ReadPacksClothAfterCloth) {
  const auto backend = CreateCpuBackend();
  const test::Scene one = test::SizedCloth(1), three = test::SizedCloth(3);
  const std::vector<ClothHandle> cloths = {CreateCloth(*backend, three),
                                           CreateCloth(*backend, one)};
  const StateColumns columns = backend->Read({cloths, true, false});
  const auto& positions = std::get<std::vector<float>>(columns.positions_m);
  ASSERT_EQ(positions.size(), 12u);
  EXPECT_EQ(positions[9], 0.1f);
  EXPECT_EQ(positions[10], 0.2f);
  EXPECT_EQ(positions[11], 0.3f);
  EXPECT_TRUE(std::get<std::vector<float>>(columns.velocities_m_per_s).empty());
}

// Bits of these cloths after some steps together.
std::string BitsTogether(const CpuBackendTesting& testing, const std::vector<test::Scene>& scenes) {
  const auto backend = CreateCpuBackend({}, testing);
  std::vector<StepItem> items;
  for (const test::Scene& scene : scenes) items.push_back({CreateCloth(*backend, scene), {}});
  for (uint32_t step = 0; step < 12; ++step) backend->Step(items);
  std::string bits;
  for (const StepItem& item : items) bits += test::ReadBits(*backend, item.cloth);
  return bits;
}

TEST(CpuBackendTest, LeavingOutCollidersChangesNoBit) {
  std::vector<test::Scene> scenes;
  for (uint32_t k = 0; k < 8; ++k) {
    for (test::Scene scene : {test::FallingOnSphere(9), test::FallingOnBoxAndCapsule(9),
                              test::FallingOnDistanceMap(9)}) {
      for (Eigen::Vector3d& p : scene.state.positions_m) p.y() += 0.05 * k;
      scenes.push_back(scene);
    }
  }
  EXPECT_TRUE(BitsTogether({.leave_out_colliders = true}, scenes) ==
              BitsTogether({.leave_out_colliders = false}, scenes));
}

TEST(CpuBackendTest, PinTargetsOfAStepStay) {
  const auto backend = CreateCpuBackend();
  test::Scene scene = test::SizedCloth(33);
  const ClothHandle cloth = CreateCloth(*backend, scene);
  scene.pin_targets_m.assign(scene.model->pin_count(), Eigen::Vector3d(0.25, 0.5, 0.125));
  StepAlone(*backend, cloth, scene);
  scene.pin_targets_m.clear();
  StepAlone(*backend, cloth, scene);
  const auto state = ReadState(*backend, cloth);
  for (const uint32_t pin : scene.model->pins()) {
    EXPECT_EQ(state.positions_m[pin], Eigen::Vector3d(0.25, 0.5, 0.125));
  }
}

// A new model keeps the state, and the targets of the pins that it keeps.
TEST(CpuBackendTest, WriteOfAModelKeepsStateAndPins) {
  const auto backend = CreateCpuBackend();
  test::Scene scene = test::Grid(3, 3, 1, 1, {0, 2});
  const ClothHandle cloth = CreateCloth(*backend, scene);
  scene.pin_targets_m = {{0, 0.5, 0}, {1, 0.25, 0}};
  StepAlone(*backend, cloth, scene);
  const auto before = ReadState(*backend, cloth);

  const test::Scene changed = test::Grid(3, 3, 1, 1, {2, 6});
  ClothUpdate update;
  update.model = changed.model;
  ASSERT_TRUE(backend->Write(cloth, update).ok());
  EXPECT_EQ(ReadState(*backend, cloth).positions_m, before.positions_m);
  StepAlone(*backend, cloth, changed);
  const auto after = ReadState(*backend, cloth);
  EXPECT_EQ(after.positions_m[2], Eigen::Vector3d(1, 0.25, 0)) << "stays a pin";
  EXPECT_EQ(after.positions_m[6], before.positions_m[6]) << "a new pin stays where it is";
  EXPECT_NE(after.positions_m[0], before.positions_m[0]) << "is free now";
}

TEST(CpuBackendTest, WriteOfParametersTakesEffect) {
  const auto backend = CreateCpuBackend();
  test::Scene scene = test::SizedCloth(1);
  const ClothHandle cloth = CreateCloth(*backend, scene);
  ClothUpdate update;
  update.parameters = scene.parameters;
  update.parameters->gravity_m_per_s2 = {6, 0, 0};
  ASSERT_TRUE(backend->Write(cloth, update).ok());
  StepAlone(*backend, cloth, scene);
  // 60 substeps of 2 additions of about 0.1 m/s at most.
  EXPECT_NEAR(ReadState(*backend, cloth).velocities_m_per_s[0].x(), 0.1, 120 * 0.1 * 0x1p-24);
  EXPECT_EQ(ReadState(*backend, cloth).velocities_m_per_s[0].y(), 0);
}

TEST(CpuBackendTest, EmptyBatch) {
  const auto backend = CreateCpuBackend();
  const BatchReport report = backend->Step({});
  EXPECT_TRUE(report.reports.empty());
  EXPECT_EQ(report.dispatch_count, 0u);
}

}  // namespace
}  // namespace drape
