#include "server/solver/cpu/model/float_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <barrier>
#include <cstddef>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "server/solver/cpu/cpu_cloth.h"
#include "server/solver/cpu/model/layout.h"
#include "tests/support/scenes.h"

namespace drape::cpu {
namespace {

TEST(FloatModelTest, EveryConstraintHasItsPlaceInAGroupOfItsColour) {
  const test::Scene scene = test::Net(7, 0.1, 1e-5);
  const FloatModel model(scene.model);
  const auto constraints = scene.model->constraints();
  const auto offsets = scene.model->colour_offsets();
  ASSERT_EQ(model.constraint_places.size(), constraints.size());
  std::set<uint32_t> places;
  for (size_t c = 0; c < constraints.size(); ++c) {
    const uint32_t place = model.constraint_places[c];
    EXPECT_TRUE(places.insert(place).second) << "two constraints in one lane";
    const DistanceGroup& group = model.groups.at(place / kVec4Size);
    const uint32_t lane = place % kVec4Size;
    EXPECT_EQ(group.i[lane], constraints[c].i);
    EXPECT_EQ(group.j[lane], constraints[c].j);
    EXPECT_EQ(group.rest_length[lane], static_cast<float>(constraints[c].rest_length_m));
    EXPECT_EQ(model.compliances.at(place / kVec4Size)[lane],
              static_cast<float>(constraints[c].compliance_m_per_n));
  }
  for (uint32_t colour = 0; colour < scene.model->colour_count(); ++colour) {
    if (offsets[colour] == 0) continue;
    EXPECT_LT(model.constraint_places[offsets[colour] - 1] / kVec4Size,
              model.constraint_places[offsets[colour]] / kVec4Size)
        << "no group holds constraints of two colours";
  }
}

TEST(FloatModelTest, FreeLanesBelongToTheSpareParticle) {
  const test::Scene scene = test::Chain(3, 0.1, 0.01);
  const FloatModel model(scene.model);
  size_t spare_lanes = 0;
  for (const DistanceGroup& group : model.groups) {
    for (uint32_t lane = 0; lane < kVec4Size; ++lane) {
      if (group.i[lane] != model.spare_particle()) continue;
      ++spare_lanes;
      EXPECT_EQ(group.j[lane], model.spare_particle());
      EXPECT_EQ(group.rest_length[lane], 0);
    }
  }
  EXPECT_EQ(spare_lanes, model.groups.size() * kVec4Size - scene.model->constraint_count());
  EXPECT_GT(spare_lanes, 0u);
}

TEST(FloatModelCacheTest, OneCopyPerModelInUse) {
  const test::Scene scene = test::Chain(3, 0.1, 0.01);
  const test::Scene other = test::Chain(4, 0.1, 0.01);
  FloatModelCache cache;
  auto first = cache.Get(scene.model);
  EXPECT_EQ(cache.Get(scene.model), first);
  auto second = cache.Get(other.model);
  EXPECT_NE(first, second);
  EXPECT_EQ(cache.size(), 2u);
  first.reset();
  EXPECT_EQ(cache.size(), 1u) << "a model that no cloth uses is dropped";
  EXPECT_EQ(cache.Get(scene.model)->particle_count, 4u);
}

std::shared_ptr<const SceneModel> HeldAt(std::vector<uint32_t> pins) {
  return test::Grid(6, 5, 1, 1, std::move(pins)).model;
}

TEST(FloatModelCacheTest, ModelsThatDifferByPinsShareALayout) {
  FloatModelCache cache;
  auto first = cache.Get(HeldAt({3}));
  const auto other = cache.Get(HeldAt({0, 14})), last = cache.Get(HeldAt({}));
  EXPECT_EQ(&first->layout(), first.get());
  EXPECT_EQ(&other->layout(), first.get());
  EXPECT_EQ(&last->layout(), first.get());
  first.reset();
  EXPECT_EQ(other->layout().pins, std::vector<uint32_t>{3}) << "kept as long as it is shared";
  const auto without_a_link = cache.Get(HeldAt({0, 1}));
  EXPECT_EQ(&without_a_link->layout(), without_a_link.get());
  EXPECT_EQ(&cache.Get(HeldAt({0, 1, 20}))->layout(), without_a_link.get());
}

TEST(FloatModelCacheTest, ThreadsThatComeTogetherGetTheSame) {
  constexpr size_t kThreads = 8;
  for (int round = 0; round < 20; ++round) {
    FloatModelCache cache;
    const std::vector models = {HeldAt({3}), HeldAt({0, 14}), HeldAt({}), HeldAt({7})};
    std::vector<std::vector<std::shared_ptr<const FloatModel>>> got(kThreads);
    std::barrier begin(kThreads);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        begin.arrive_and_wait();
        for (size_t k = 0; k < models.size(); ++k) {
          got[t].push_back(cache.Get(models[(t + k) % models.size()]));
        }
        std::rotate(got[t].begin(), got[t].end() - static_cast<std::ptrdiff_t>(t % models.size()),
                    got[t].end());
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (size_t t = 1; t < kThreads; ++t) EXPECT_EQ(got[t], got[0]);
    for (const auto& model : got[0]) EXPECT_EQ(&model->layout(), &got[0][0]->layout());
    EXPECT_EQ(cache.size(), models.size());
  }
}

TEST(PartsOfModelsTest, AreThereAsLongAsTheyAreHeld) {
  PartsOfModels parts;
  const auto model = HeldAt({3});
  ClothParameters parameters;
  parameters.self_collision.emplace();
  auto held = parts.ForCloth(model, parameters);
  const FloatModel* const made = parts.models.Get(model).get();
  const ContactSurface* const surface = parts.surfaces.Get(model).get();
  EXPECT_EQ(parts.models.Get(model).get(), made);
  EXPECT_EQ(parts.surfaces.Get(model).get(), surface);
  EXPECT_EQ(parts.models.size(), 1u);
  held.reset();
  EXPECT_EQ(parts.models.size(), 0u);
}

// What a step would have to make, for which nobody should wait: with the first step of a world, or
// with the first in which a collider moves.
TEST(PartsOfModelsTest, AreThereBeforeAStepNeedsThem) {
  PartsOfModels parts;
  const auto model = HeldAt({});
  ClothParameters parameters;
  const auto are_held = [&] {
    const auto held = parts.ForCloth(model, parameters);
    return std::pair(parts.surfaces.Get(model).use_count() > 1,
                     parts.parts.Get(model).use_count() > 1);
  };
  EXPECT_EQ(are_held(), std::pair(false, false));
  parameters.is_in_world = true;
  EXPECT_EQ(are_held(), std::pair(true, false));
  parameters.is_in_world = false;
  parameters.colliders = {CylinderBetween({0, -2, 0}, {0, -1, 0}, 0.1)};
  EXPECT_EQ(are_held(), std::pair(false, true));
}

// Strips that cross at the pin of the layout alone are solved in one phase, which is wrong where
// that particle is free.
TEST(LayoutTest, HoldsOnlyWhereItsStripsMayMeet) {
  ParticleTopology cross;
  cross.positions_m.emplace_back(0, 0, 0);
  for (const auto& [x, z] : {std::pair{1, 0}, {2, 0}, {-1, 0}, {-2, 0}, {0, 1}, {0, -1}}) {
    cross.positions_m.emplace_back(x, 0, z);
  }
  cross.masses_kg.assign(7, 1.0);
  for (const auto& [i, j] : {std::pair{0u, 1u}, {1u, 2u}, {0u, 3u}, {3u, 4u}, {0u, 5u}, {0u, 6u}}) {
    cross.distance_constraints.push_back({.i = i, .j = j, .rest_length_m = 1});
  }
  const auto held = test::Particles(cross, {0}).model, free = test::Particles(cross, {}).model;
  ASSERT_EQ(held->strips().phase_count(), 1u);
  ASSERT_EQ(free->strips().phase_count(), 2u);
  EXPECT_FALSE(FitsLayout(*free, *held));
  EXPECT_TRUE(FitsLayout(*held, *free));
  EXPECT_EQ(LayoutHash(*held), LayoutHash(*free));
}

}  // namespace
}  // namespace drape::cpu
