// A list of the wrong size is refused by every backend, and the cloth goes on as if nothing had
// been written.
#include "server/solver/update_check.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

class UpdateCheckTest : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, UpdateCheckTest, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

struct BadUpdate {
  std::string list;
  std::function<void(const Scene&, ClothUpdate&)> make;
};

std::vector<BadUpdate> BadUpdates() {
  return {
      {"pin_targets_m",
       [](const Scene& scene, ClothUpdate& update) {
         update.pin_targets_m.emplace(scene.model->pin_count() + 1, Vector3d::Zero());
       }},
      {"pin_targets_m", [](const Scene&, ClothUpdate& update) { update.pin_targets_m.emplace(); }},
      {"rest_lengths_m",
       [](const Scene& scene, ClothUpdate& update) {
         update.rest_lengths_m.emplace(scene.model->constraint_count() - 1, 1.0);
       }},
      {"collider_motions",
       [](const Scene&, ClothUpdate& update) {
         update.collider_motions = std::vector{RigidMotion::AtRest(Vector3d::Zero())};
       }},
      {"positions_m",
       [](const Scene& scene, ClothUpdate& update) {
         update.state = scene.state;
         update.state->positions_m.pop_back();
       }},
      {"velocities_m_per_s",
       [](const Scene& scene, ClothUpdate& update) {
         update.state = scene.state;
         update.state->velocities_m_per_s.pop_back();
       }},
      {"model", [](const Scene&, ClothUpdate& update) { update.model = SizedCloth(34).model; }},
      // The targets fit the model that the cloth had.
      {"pin_targets_m",
       [](const Scene& scene, ClothUpdate& update) {
         update.model = Grid(3, 11, 1, 1, {0, 2, 32}).model;
         update.pin_targets_m.emplace(scene.model->pin_count(), Vector3d::Zero());
       }},
  };
}

TEST_P(UpdateCheckTest, AListOfTheWrongSizeIsRefused) {
  Backend& backend = SharedBackend(GetParam());
  const Scene scene = Grid(3, 11, 1, 1, {0, 2});
  const ClothHandle cloth = CreateCloth(backend, scene);
  const ClothHandle other = CreateCloth(backend, scene);
  for (const BadUpdate& bad : BadUpdates()) {
    ClothUpdate update;
    bad.make(scene, update);
    const Status status = backend.Write(cloth, update);
    EXPECT_EQ(status.code(), StatusCode::kInternal) << bad.list;
    EXPECT_EQ(status.reason(), "SIZES_DISAGREE") << bad.list;
    EXPECT_EQ(status.message().rfind(bad.list, 0), 0u) << status.message();
    StepAlone(backend, cloth, scene);
    StepAlone(backend, other, scene);
    EXPECT_EQ(ReadBits(backend, cloth), ReadBits(backend, other)) << bad.list;
  }
  Scene unfit = scene;
  unfit.state.positions_m.pop_back();
  EXPECT_EQ(backend.Create(unfit.model, unfit.parameters, unfit.state).status().reason(),
            "SIZES_DISAGREE");
  backend.Destroy(cloth);
  backend.Destroy(other);
}

}  // namespace
}  // namespace drape::test
