// How many edges, triangles and particles may come near solids at the same time.
#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "server/scene/scene_model.h"
#include "server/solver/surface_contact/surface_contacts.h"
#include "tests/surface_contact/lowest_point_test.h"

namespace drape::surface_contact {
namespace {

// A sheet on balls that are all in one place, below the middle of an edge.
template <class V>
class RoomTest : public testing::Test {
 protected:
  RoomTest() {
    ModelDescription description;
    description.topology = GridTopology{10, 10, 0.5, 0.5};
    model_ = SceneModel::Build(description).value();
    for (const Eigen::Vector3d& p : model_->rest_positions_m()) {
      positions_.push_back(self_contact::ToVector<V>(p));
      inverse_masses_.push_back(100);
    }
    const auto rest_m = model_->rest_positions_m();
    const Eigen::Vector3d middle_m = (rest_m[44] + rest_m[45]) / 2;
    colliders_.assign(8, SphereAt(middle_m - Eigen::Vector3d(0, 0.0999, 0), 0.1));
    for (uint32_t k = 0; k < colliders_.size(); ++k) places_.push_back(k);
  }

  // The solids that something is near in the first substep.
  std::set<uint32_t> Touched(size_t most_contacts) {
    const SurfaceParts parts(*model_);
    StepNumbers<V> numbers;
    numbers.gravity[1] = -10;
    numbers.edge_length = static_cast<ScalarOf<V>>(model_->length_scale_m());
    numbers.time_step_s = 1.0 / 60;
    numbers.inverse_masses = inverse_masses_;
    numbers.most_contacts = most_contacts;
    const EdgesOfStep edges{ColliderContact::kSurface, model_->length_scale_m()};
    contacts_.Begin(parts, {colliders_, {}, places_, 0, edges}, numbers);
    contacts_.Find(positions_, std::vector<V>(positions_.size()));
    std::set<uint32_t> touched;
    for (const auto* contact : contacts_.active()) touched.insert(contact->solid);
    return touched;
  }

  std::shared_ptr<const SceneModel> model_;
  std::vector<Collider> colliders_;
  std::vector<uint32_t> places_;
  std::vector<V> positions_;
  std::vector<ScalarOf<V>> inverse_masses_;
  SurfaceContacts<V> contacts_;
};
TYPED_TEST_SUITE(RoomTest, Vectors);

TYPED_TEST(RoomTest, WhereItEndsTheLastSolidsAreGivenUp) {
  EXPECT_EQ(this->Touched(kMostContacts).size(), 8u);
  EXPECT_FALSE(this->contacts_.has_given_up());
  std::set<size_t> counts;
  for (size_t most = 0; most < 1000; most += 10) {
    const std::set<uint32_t> touched = this->Touched(most);
    counts.insert(touched.size());
    const size_t end = touched.empty() ? 0 : *touched.rbegin() + 1;
    EXPECT_EQ(touched.size(), end) << "not the first ones";
    EXPECT_EQ(this->contacts_.has_given_up(), touched.size() < 8) << most;
  }
  EXPECT_EQ(counts.size(), 9u) << "none to all";
}

}  // namespace
}  // namespace drape::surface_contact
