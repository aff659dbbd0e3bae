// Sessions that make cloths of what was saved.
#include <gtest/gtest.h>

#include <chrono>

#include "server/scene/distance_map.h"
#include "server/session/session_registry.h"
#include "tests/session/session_fixture.h"
#include "tests/support/solids/solids.h"

namespace drape {
namespace {

class SessionImports : public SessionFixture {
 protected:
  // The only cloth of a new session, saved.
  SavedCloth Saved(ClothCreation creation) {
    const SessionLease other = registry_->Create(std::nullopt, "other").value();
    const auto ids = Create(*other, std::move(creation)).value().ids;
    Awaited<Status> saved;
    other->SaveStates(other->FindCloths({}).value(), "a",
                      [saved](const Result<SavedSummary>& r) mutable {
                        saved.Set(r.ok() ? Status::Ok() : r.status());
                      });
    EXPECT_TRUE(saved.Get().ok());
    return other->FindSaved("a")->cloths.at(0);
  }
  Result<std::vector<ClothId>> Import(std::vector<SavedCloth> cloths) {
    Awaited<Result<std::vector<ClothId>>> ids;
    session().ImportCloths(std::move(cloths), [ids](Result<std::vector<ClothId>> r) mutable {
      ids.Set(std::move(r));
    });
    return ids.Get();
  }
};

// Two triangles.
ClothCreation Square(const std::string& world) {
  ClothCreation creation;
  ModelDescription description;
  description.topology = GridTopology{2, 2, 0.1, 0.1};
  creation.description = std::make_shared<const ModelDescription>(std::move(description));
  creation.model = SceneModel::Build(*creation.description).value();
  creation.world = world;
  creation.copies.emplace_back();
  return creation;
}

std::vector<SavedCloth> InWorldsOfTheirOwn(const SavedCloth& cloth, size_t count) {
  std::vector<SavedCloth> cloths(count, cloth);
  for (size_t k = 0; k < count; ++k) cloths[k].world = "world " + std::to_string(k);
  return cloths;
}

// Nothing is counted over the whole session for each of the worlds: that would take eighty times as
// long.
TEST_F(SessionImports, ManyWorldsTakeAboutAsLongAsTheirCloths) {
  constexpr size_t kCount = 10'000;
  Start();
  const SavedCloth cloth = Saved(Square(""));
  const auto seconds_for = [&](std::vector<SavedCloth> cloths) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(Import(std::move(cloths)).value().size(), kCount);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const double alone_s = seconds_for(std::vector<SavedCloth>(kCount, cloth));
  EXPECT_LT(seconds_for(InWorldsOfTheirOwn(cloth, kCount)), 5 * alone_s + 0.5);
  EXPECT_EQ(session().cloth_count(), 2 * kCount);
}

TEST_F(SessionImports, WorldsThatAreThereAlreadyAreRefusedUntilTheirLastClothIsGone) {
  Start();
  const std::vector<SavedCloth> cloths = InWorldsOfTheirOwn(Saved(Square("")), 3);
  const ClothList first = Find({Create(Square("world 1")).value().ids[0]});
  const ClothList second = Find({Create(Square("world 1")).value().ids[0]});
  const auto refused = [&] {
    const auto ids = Import(cloths);
    return ids.ok() ? "" : ids.status().violations().at(0).field;
  };
  EXPECT_EQ(refused(), "world");
  EXPECT_TRUE(Delete(first).ok());
  EXPECT_EQ(refused(), "world");
  EXPECT_TRUE(Delete(second).ok());
  EXPECT_EQ(refused(), "");
  EXPECT_EQ(refused(), "world");
}

TEST_F(SessionImports, OneThatNobodyWantsAnyMoreTakesNothing) {
  SessionLimits limits;
  limits.max_cloths_per_session = 1;
  Start(limits);
  const SavedCloth cloth = Saved(Chains(1, 3));
  StopWhenUnwanted at_once([] { return true; });
  bool is_done = false;
  EXPECT_THROW(session().ImportCloths(
                   {cloth}, [&](const auto&) { is_done = true; }, &at_once),
               WorkStopped);
  EXPECT_FALSE(is_done);
  EXPECT_EQ(session().cloth_count(), 0u);
  EXPECT_EQ(Import({cloth}).value().size(), 1u) << "its room is not there";
  EXPECT_EQ(Import({cloth}).status().reason(), "QUOTA_EXCEEDED");
}

// Whichever of them it is.
TEST_F(SessionImports, EveryClothOfAWorldIsChecked) {
  Start();
  const SavedCloth square = Saved(Square("")), chain = Saved(Chains(1, 3));
  for (size_t odd = 0; odd < 3; ++odd) {
    std::vector<SavedCloth> cloths(3, square);
    cloths[odd] = chain;
    for (SavedCloth& cloth : cloths) cloth.world = "heap";
    EXPECT_EQ(Import(cloths).status().violations().at(0).field, "world") << odd;

    cloths[odd] = square;
    cloths[odd].world = "heap";
    auto finer = std::make_shared<ClothDescription>(*square.description);
    finer->parameters.settings.substeps += 1;
    cloths[odd].description = std::move(finer);
    EXPECT_EQ(Import(cloths).status().violations().at(0).field, "spec.settings.substeps") << odd;
  }
  std::vector<SavedCloth> many(kMaxClothsPerWorld + 1, square);
  for (SavedCloth& cloth : many) cloth.world = "heap";
  EXPECT_EQ(Import(many).status().reason(), "QUOTA_EXCEEDED");
  EXPECT_EQ(session().cloth_count(), 0u);
}

// A chain beside boxes of these sides, two of each.
ClothCreation BesideBoxes(const std::vector<double>& sides_m) {
  ClothCreation creation = Chains(1, 2);
  for (const double side_m : sides_m) {
    const auto map = DistanceMap::Build(
        test::BoxMesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(side_m)),
        {.resolution = 4});
    for (int twice = 0; twice < 2; ++twice) {
      creation.copies[0].parameters.colliders.push_back(DistanceMapAt(*map));
    }
  }
  return creation;
}

// A map counts until the last of its cloths is gone, and for no other cloth.
TEST_F(SessionImports, ClothsHoldTheChargesOfTheirOwnMaps) {
  Start();
  const SavedCloth both = Saved(BesideBoxes({1, 2})), none = Saved(Chains(1, 2));
  const SavedCloth other = Saved(BesideBoxes({3}));
  const ClothList cloths = Find(Import({both, none, other, both}).value());
  std::vector<size_t> charges;
  for (const auto& cloth : cloths) charges.push_back(cloth->charges().maps.size());
  EXPECT_EQ(charges, (std::vector<size_t>{2, 0, 1, 2}));
  const uint64_t all_bytes = session().map_bytes();
  EXPECT_TRUE(Delete({cloths[0]}).ok());
  EXPECT_EQ(session().map_bytes(), all_bytes);
  EXPECT_TRUE(Delete({cloths[2]}).ok());
  EXPECT_LT(session().map_bytes(), all_bytes);
  EXPECT_TRUE(Delete({cloths[1], cloths[3]}).ok());
  EXPECT_EQ(session().map_bytes(), 0u);
}

}  // namespace
}  // namespace drape
