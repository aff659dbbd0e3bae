// What the colliders of cloths, and the descriptions of models, count for.
#include <gtest/gtest.h>

#include "tests/session/session_fixture.h"

namespace drape {
namespace {

constexpr size_t kColliders = 256;  // about 0.5 MB

class ColliderChargesTest : public SessionFixture {
 protected:
  ColliderChargesTest() {
    SessionLimits limits;
    limits.max_model_bytes = 4 << 20;  // an owner may have half
    Start(limits);
  }

  static std::vector<Collider> Spheres(size_t count) { return {count, SphereAt({0, -5, 0}, 1)}; }
  static ClothCreation ChainsAmong(size_t copies, size_t colliders) {
    ClothCreation creation = Chains(copies, 4);
    for (ClothCopy& copy : creation.copies) copy.parameters.colliders = Spheres(colliders);
    return creation;
  }
  static ClothChange To(size_t colliders) {
    ClothChange change;
    change.colliders = Spheres(colliders);
    return change;
  }
  static void ExpectRefused(const Status& status) {
    EXPECT_EQ(status.reason(), "QUOTA_EXCEEDED") << status.ToString();
    EXPECT_NE(status.message().find("max_model_bytes"), std::string::npos) << status.message();
  }
  void Save(const ClothList& cloths) {
    Awaited<Result<SavedSummary>> saved;
    session().SaveStates(cloths, "here",
                         [saved](Result<SavedSummary> r) mutable { saved.Set(std::move(r)); });
    ASSERT_TRUE(saved.Get().ok());
  }
  Status Load(const ClothList& into, ClothId from) {
    std::vector<ClothId> ids;
    for (const auto& cloth : into) ids.push_back(cloth->id);
    Awaited<Status> loaded;
    session().LoadStates("here", ids, std::vector<ClothId>(ids.size(), from),
                         [loaded](const Status& s) mutable { loaded.Set(s); });
    return loaded.Get();
  }
  Status Import() {
    Awaited<Status> imported;
    session().ImportCloths(
        session().FindSaved("here")->cloths,
        [imported](const Result<std::vector<ClothId>>& r) mutable { imported.Set(r.status()); });
    return imported.Get();
  }
};

TEST_F(ColliderChargesTest, OfAllCopiesOfACreationUntilTheyEnd) {
  EXPECT_TRUE(Create(Chains(1000, 4)).ok()) << "without colliders";
  ExpectRefused(Create(ChainsAmong(8, kColliders)).status());
  const auto created = Create(ChainsAmong(4, kColliders));
  ASSERT_TRUE(created.ok()) << "nothing of what was refused counts: " << created.status().message();
  ExpectRefused(Create(ChainsAmong(1, kColliders)).status());
  ASSERT_TRUE(Delete(Find({created->ids[0]})).ok());
  EXPECT_TRUE(Create(ChainsAmong(1, kColliders)).ok());
}

TEST_F(ColliderChargesTest, OfAnUpdateAsManyAsTheClothHasEverHad) {
  const ClothList cloths = Find(Create(Chains(8, 4)).value().ids);
  ExpectRefused(Update(cloths, To(kColliders)).status());
  EXPECT_TRUE(cloths[0]->description()->parameters.colliders.empty());
  const ClothList four(cloths.begin(), cloths.begin() + 4);
  ASSERT_TRUE(Update(four, To(kColliders)).ok());
  EXPECT_TRUE(Update(four, To(0)).ok());
  ExpectRefused(Update({cloths[4]}, To(kColliders)).status());
  EXPECT_TRUE(Update(four, To(kColliders)).ok()) << "they count already";
}

TEST_F(ColliderChargesTest, OfEveryClothThatBecomesASavedOne) {
  const ClothId first = Create(ChainsAmong(1, kColliders)).value().ids[0];
  const ClothList others = Find(Create(Chains(8, 4)).value().ids);
  Save(Find({first}));
  ExpectRefused(Load(others, first));
  EXPECT_TRUE(Load({others[0], others[1], others[2]}, first).ok());
  EXPECT_EQ(others[0]->held_colliders.count(), kColliders);
  EXPECT_EQ(others[3]->held_colliders.count(), 0u);
}

TEST_F(ColliderChargesTest, OfImportedCloths) {
  const auto ids = Create(ChainsAmong(2, kColliders)).value().ids;
  Save(Find(ids));
  EXPECT_TRUE(Import().ok());
  ExpectRefused(Import());
}

// Also once the cloth has another description.
TEST_F(ColliderChargesTest, OfSavedStatesAmongTheirBytes) {
  const auto ids = Create(ChainsAmong(1, kColliders)).value().ids;
  Save(Find(ids));
  const uint64_t with = session().FindSaved("here")->bytes;
  ASSERT_TRUE(Update(Find(ids), To(0)).ok());
  Save(Find(ids));
  EXPECT_GT(with, session().FindSaved("here")->bytes + kColliders * sizeof(Collider));
}

// Cloths that have changed each by itself share a model again, but not what it was built from.
TEST_F(ColliderChargesTest, DescriptionsOfEqualModelsCountEach) {
  ClothCreation creation = Chains(1, 2);
  ModelDescription net = *creation.description;
  auto& constraints = std::get<ParticleTopology>(net.topology).distance_constraints;
  constraints.assign(1000, constraints.at(0));
  creation.description = std::make_shared<const ModelDescription>(std::move(net));
  creation.model = SceneModel::Build(*creation.description).value();
  size_t made = 0;
  Status status;
  for (; made < 200 && status.ok(); made += status.ok() ? 1 : 0) {
    creation.description = std::make_shared<const ModelDescription>(*creation.description);
    status = Create(creation).status();
  }
  ExpectRefused(status);
  EXPECT_GT(made, 1u);
}

}  // namespace
}  // namespace drape
