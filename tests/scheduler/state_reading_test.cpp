#include "server/scheduler/state_reading.h"

#include <gtest/gtest.h>

#include "tests/scheduler/fake_backend.h"

namespace drape {
namespace {

// The middle cloth has taken one step: its particles are at y = -1.
TEST(StateReading, OneReadIsCutIntoASliceForEach) {
  const auto device = std::make_shared<FakeDevice>();
  FakeBackend backend(device);
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (const uint32_t particles : {2u, 3u, 2u}) {
    cloths.push_back(BeginCloth(backend, ChainModel(particles)));
  }
  const StepItem second{cloths[1]->handle(), {}, false};
  backend.Step(std::span(&second, 1));

  const std::vector<ClothSpan> receivers{ClothSpan(cloths).first(2), ClothSpan(cloths).last(2)};
  const auto columns = SharedRead(backend, receivers, {true, true}).Take();
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_EQ(device->reads(), std::vector<size_t>{4});
  EXPECT_EQ(std::get<std::vector<double>>(columns[0].positions_m),
            (std::vector<double>{0, 0, 0, 1, 0, 0, 0, -1, 0, 1, -1, 0, 2, -1, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(columns[1].positions_m),
            (std::vector<double>{0, -1, 0, 1, -1, 0, 2, -1, 0, 0, 0, 0, 1, 0, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(columns[1].velocities_m_per_s),
            std::vector<double>(15, 0));
}

TEST(StateReading, FieldsThatAreNotWantedAreEmpty) {
  FakeBackend backend(std::make_shared<FakeDevice>());
  const std::vector<std::shared_ptr<ClothRuntime>> cloths{BeginCloth(backend, ChainModel(2))};
  const ClothStates states = ReadClothStates(backend, cloths, {.velocities = true});
  EXPECT_EQ(std::get<std::vector<double>>(states.columns.velocities_m_per_s).size(), 6u);
  EXPECT_TRUE(
      std::visit([](const auto& column) { return column.empty(); }, states.columns.positions_m));
  EXPECT_EQ(states.cloths.size(), 1u);
}

TEST(StateReading, OnlyTheParticlesThatAreWanted) {
  FakeBackend backend(std::make_shared<FakeDevice>());
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (const uint32_t particles : {4u, 3u, 5u}) {
    cloths.push_back(BeginCloth(backend, ChainModel(particles)));
  }
  const StateFields fields{.positions = true, .particles = {0, 2}};
  const ClothStates states = ReadClothStates(backend, cloths, fields);
  EXPECT_EQ(std::get<std::vector<double>>(states.columns.positions_m),
            (std::vector<double>{0, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 0}));

  const StepItem second{cloths[1]->handle(), {}, false};
  backend.Step(std::span(&second, 1));
  const std::vector<ClothSpan> receivers{ClothSpan(cloths).first(2), ClothSpan(cloths).last(1)};
  const auto columns = SharedRead(backend, receivers, fields).Take();
  EXPECT_EQ(std::get<std::vector<double>>(columns[0].positions_m),
            (std::vector<double>{0, 0, 0, 2, 0, 0, 0, -1, 0, 2, -1, 0}));
  EXPECT_EQ(std::get<std::vector<double>>(columns[1].positions_m),
            (std::vector<double>{0, 0, 0, 2, 0, 0}));
}

// Two vertices of the second of three cloths are one particle.
TEST(StateReading, MergedVerticesHaveARowEach) {
  FakeBackend backend(std::make_shared<FakeDevice>());
  ModelDescription description;
  description.topology = TriangleMesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, 1}, {2, 0, 1}}, {{0, 2, 1}, {3, 4, 5}}};
  const auto merged = SceneModel::Build(description).value();
  ASSERT_EQ(merged->particle_count(), 4u);
  std::vector<std::shared_ptr<ClothRuntime>> cloths{BeginCloth(backend, ChainModel(2)),
                                                    BeginCloth(backend, merged),
                                                    BeginCloth(backend, ChainModel(2))};
  const std::vector<ClothSpan> receivers{ClothSpan(cloths).first(2), ClothSpan(cloths).last(1)};
  const auto columns = SharedRead(backend, receivers, {.positions = true}).Take();
  EXPECT_EQ(std::get<std::vector<double>>(columns[0].positions_m),
            (std::vector<double>{0, 0, 0, 1, 0, 0,  //
                                 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 2, 0, 1}));
  EXPECT_EQ(std::get<std::vector<double>>(columns[1].positions_m),
            (std::vector<double>{0, 0, 0, 1, 0, 0}));

  const StateFields some{.positions = true, .particles = {3, 5}};
  const ClothStates states = ReadClothStates(backend, ClothSpan(cloths).subspan(1, 1), some);
  EXPECT_EQ(std::get<std::vector<double>>(states.columns.positions_m),
            (std::vector<double>{1, 0, 0, 2, 0, 1}));
  const ClothStates drawn =
      ReadForPicture(backend, ClothSpan(cloths).subspan(1, 1), {.positions = true}, true);
  EXPECT_EQ(std::get<std::vector<double>>(drawn.columns.positions_m).size(), 3 * 4u);
}

}  // namespace
}  // namespace drape
