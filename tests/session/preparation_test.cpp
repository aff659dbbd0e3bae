// What takes long is made before the device thread begins.
#include "server/session/preparation.h"

#include <gtest/gtest.h>

#include "tests/session/cpu_scheduler.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

ClothCreation Sheets(size_t copies) {
  ClothCreation creation = Chains(copies, 2);
  ModelDescription sheet;
  sheet.topology = GridTopology{8, 8, 1, 1};
  creation.description = std::make_shared<const ModelDescription>(sheet);
  creation.model = SceneModel::Build(sheet).value();
  return creation;
}

Collider Post() {
  return CylinderBetween({0, -9, 0}, {0, -5, 0}, 0.1);
}

class PreparationTest : public SessionFixture {
 protected:
  PreparationTest() {
    scheduler_ = StartCpuScheduler(clock_);
    registry_ = std::make_unique<SessionRegistry>(*scheduler_, SessionLimits(), clock_, "server7");
    lease_ = registry_->Create(std::nullopt, "test").value();
  }
  ClothList CreateSheets(size_t copies) { return Find(Create(Sheets(copies)).value().ids); }
};

TEST(Preparation, EveryKindIsPreparedHoweverLateItComes) {
  BackendDescription backend;
  std::vector<const SceneModel*> models;
  backend.make_shared_parts = [&](const auto& model, const ClothParameters&, Interruption*) {
    models.push_back(model.get());
    return nullptr;
  };
  Preparation preparation(backend);
  const auto first = Sheets(1).model, second = Sheets(1).model;
  ClothParameters plain, touching;
  touching.self_collision.emplace();
  const auto add = [&](size_t count, const auto& model, const ClothParameters& parameters) {
    models.clear();
    for (size_t k = 0; k < count; ++k) preparation.Add(model, parameters, {});
    return models.size();
  };
  EXPECT_EQ(add(20, first, plain), Preparation::kMaxOfOneKind);
  EXPECT_EQ(add(20, second, plain), 1u);
  EXPECT_EQ(models[0], second.get());
  EXPECT_EQ(add(20, first, touching), 1u);
  EXPECT_EQ(add(20, first, plain), 0u);
}

TEST(Preparation, IsAskedBeforeEachCloth) {
  BackendDescription backend;
  size_t made = 0, asked = 0;
  backend.make_shared_parts = [&](const auto&, const ClothParameters&, Interruption*) {
    ++made;
    return nullptr;
  };
  StopWhenUnwanted third([&] { return ++asked == 3; });
  Preparation preparation(backend, &third);
  const auto model = Sheets(1).model;
  preparation.Add(model, {}, {});
  preparation.Add(model, {}, {});
  EXPECT_THROW(preparation.Add(model, {}, {}), WorkStopped);
  EXPECT_EQ(made, 2u);
}

TEST_F(PreparationTest, OnlyChangesOfWhatTouchesMayNeedParts) {
  const ClothList cloths = CreateSheets(2);
  const auto needs_parts = [&](const auto& set) {
    ClothChange change;
    set(change);
    return MayNeedParts(cloths, change);
  };
  EXPECT_FALSE(needs_parts([](auto& change) { change.gravity_m_per_s2.emplace(); }));
  EXPECT_FALSE(needs_parts([](auto& change) { change.settings.emplace(); }));
  // A plane has no other side, and no middle of an edge sinks into it.
  EXPECT_FALSE(needs_parts([](auto& change) {
    change.colliders = std::vector<Collider>{PlaneThrough({0, -5, 0}, {0, 1, 0})};
  }));
  // Even a ball of 2 m may be thin for a cloth that is fast enough.
  EXPECT_TRUE(needs_parts([](auto& change) {
    change.colliders = std::vector<Collider>{SphereAt({0, -5, 0}, 2)};
  }));
  const auto posts = [](auto& change) { change.colliders = std::vector<Collider>{Post()}; };
  EXPECT_TRUE(needs_parts(posts));
  const auto touches = [](auto& change) { change.self_collision.emplace().emplace(); };
  EXPECT_TRUE(needs_parts(touches));
  ClothChange change;
  posts(change);
  touches(change);
  ASSERT_TRUE(Update(cloths, change).ok());
  EXPECT_FALSE(needs_parts(posts)) << "they have them already";
  EXPECT_FALSE(needs_parts(touches));
}

// Another cloth that becomes it would wait for the device thread, and everybody with it.
TEST_F(PreparationTest, SavedClothsHoldTheirParts) {
  const ClothList cloths = CreateSheets(1);
  Awaited<Status> saved;
  session().SaveStates(cloths, "here",
                       [saved](const Result<SavedSummary>& r) mutable { saved.Set(r.status()); });
  ASSERT_TRUE(saved.Get().ok());
  EXPECT_NE(session().FindSaved("here")->cloths[0].parts, nullptr);
}

}  // namespace
}  // namespace drape
