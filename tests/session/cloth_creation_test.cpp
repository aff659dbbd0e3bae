#include "server/session/cloth_creation.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "server/session/preparation.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

class ClothCreationTest : public testing::Test {
 protected:
  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  FakeBackend backend_{device_};
};

TEST_F(ClothCreationTest, CopiesAreMadeInPiecesAndUnmadeTogether) {
  const ClothCreation creation = Chains(5, 2);
  ClothMaker maker(creation, creation.model, "plan");
  EXPECT_TRUE(maker.Make(backend_, 0, 2).ok());
  EXPECT_EQ(device_->live_cloths(), 2u);
  EXPECT_TRUE(maker.Make(backend_, 2, 5).ok());
  ASSERT_EQ(maker.made().size(), 5u);
  for (size_t k = 0; k < 5; ++k) {
    EXPECT_EQ(maker.made()[k]->placement.environment_origin_m.x(), 10.0 * static_cast<double>(k));
    EXPECT_TRUE(maker.made()[k]->runtime->is_alive());
  }
  FreeCloths(backend_, maker.TakeMade());
  EXPECT_EQ(device_->live_cloths(), 0u);
}

TEST_F(ClothCreationTest, AnErrorLeavesWhatWasMadeToBeUnmade) {
  device_->SetCapacity(3);
  const ClothCreation creation = Chains(5, 2);
  ClothMaker maker(creation, creation.model, "plan");
  EXPECT_EQ(maker.Make(backend_, 0, 5).reason(), "DEVICE_FULL");
  EXPECT_EQ(maker.made().size(), 3u);
  FreeCloths(backend_, maker.TakeMade());
  EXPECT_EQ(device_->live_cloths(), 0u);
}

TEST_F(ClothCreationTest, FreeingTwiceFreesOnce) {
  const ClothCreation creation = Chains(1, 2);
  ClothMaker maker(creation, creation.model, "plan");
  EXPECT_TRUE(maker.Make(backend_, 0, 1).ok());
  FreeCloth(backend_, *maker.made()[0]);
  FreeCloth(backend_, *maker.made()[0]);
  EXPECT_EQ(device_->live_cloths(), 0u);
}

// A large model takes the device thread long if its parts are not there yet.
TEST_F(ClothCreationTest, SharedPartsAreMadeBeforeAndHeldUntilTheClothsAreThere) {
  ClothCreation creation = Chains(20, 2);
  const auto part = std::make_shared<const int>(7);
  BackendDescription backend = backend_.Describe();
  std::vector<const SceneModel*> models;
  backend.make_shared_parts = [&](const auto& model, const ClothParameters&, Interruption*) {
    models.push_back(model.get());
    return part;
  };
  PrepareCloths(creation, backend);
  EXPECT_EQ(models,
            std::vector<const SceneModel*>(Preparation::kMaxOfOneKind, creation.model.get()));
  EXPECT_EQ(part.use_count(), 1 + static_cast<long>(Preparation::kMaxOfOneKind));
  {
    const auto model = creation.model;
    ClothMaker maker(std::exchange(creation, {}), model, "plan");
    EXPECT_TRUE(maker.Make(backend_, 0, 20).ok());
    EXPECT_EQ(part.use_count(), 1 + static_cast<long>(Preparation::kMaxOfOneKind));
    FreeCloths(backend_, maker.TakeMade());
  }
  EXPECT_EQ(part.use_count(), 1);
}

TEST_F(ClothCreationTest, PinsAreSortedByParticle) {
  const auto model = Chains(1, 8).model;
  const auto pins = PinsOf(*model, {{7, std::nullopt}, {1, std::nullopt}, {4, std::nullopt}});
  EXPECT_EQ(pins[0].particle, 1u);
  EXPECT_EQ(pins[1].particle, 4u);
  EXPECT_EQ(pins[2].particle, 7u);
}

}  // namespace
}  // namespace drape
