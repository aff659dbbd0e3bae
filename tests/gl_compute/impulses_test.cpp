// Impulses of a step: no bit of them depends on how the device computes it; the lists that they are
// added up from.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <vector>

#include "server/solver/gl_compute/pull_lists.h"
#include "tests/gl_compute/test_cloths.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/scenes.h"

namespace drape {
namespace {

using Eigen::Vector3d;

StepItem Asking(ClothHandle cloth, const test::Scene& scene) {
  return {.cloth = cloth,
          .pin_targets_m = scene.pin_targets_m,
          .rest_lengths_m = scene.rest_length_targets_m,
          .grips = scene.grips,
          .impulses = true,
          .contact_impulses = true};
}

std::vector<Vector3d> VectorsOf(const StepReport& report) {
  if (report.impulses == nullptr) return {};
  std::vector<Vector3d> vectors = report.impulses->pins_n_s;
  vectors.insert(vectors.end(), report.impulses->grips_n_s.begin(),
                 report.impulses->grips_n_s.end());
  for (const ColliderImpulse& collider : report.impulses->colliders) {
    vectors.push_back(collider.impulse_n_s);
    vectors.push_back(collider.angular_impulse_n_m_s);
  }
  if (!report.impulses->contacts) return vectors;
  for (const ParticleImpulse& contact : *report.impulses->contacts) {
    vectors.push_back(Vector3d(contact.particle, contact.collider, 0));
    vectors.push_back(contact.impulse_n_s);
  }
  return vectors;
}

// Held by pins and grips, thrown at colliders: resident, and tiled in several pieces.
std::vector<test::Scene> Scenes() {
  test::Scene resident = test::FallingOnSphere(12);
  test::GripParticles(resident, {0, 77, 143}, {0, -0.02, 0});
  test::Scene tiled = test::FallingOnSphere(50);
  test::GripParticles(tiled, {0, 77, 2499}, {0, -0.02, 0});
  test::Scene pinned = test::Grid(40, 30, 1, 0.8, {0, 20, 39});
  test::Stir(pinned, 0.5);
  for (test::Scene* scene : {&resident, &tiled}) {
    for (Vector3d& v : scene->state.velocities_m_per_s) v.y() = -4;
  }
  for (test::Scene* scene : {&resident, &tiled, &pinned}) {
    scene->parameters.settings.substeps = 4;
  }
  return {resident, tiled, pinned};
}

TEST(ImpulsesTest, LocalSizePartsPiecesAndSlotChangeNoBit) {
  const auto usual = MakeGlBackend();
  const auto narrow = MakeGlBackend({.local_size = 16});
  const auto in_parts = MakeGlBackend({.local_size = 16, .loop_budget = 3000});
  for (const test::Scene& scene : Scenes()) {
    SCOPED_TRACE(scene.name);
    const ClothHandle first = test::CreateCloth(*usual, scene);
    const ClothHandle second = test::CreateCloth(*usual, scene);
    const std::vector<StepItem> both = {Asking(first, scene), Asking(second, scene)};
    const BatchReport batch = usual->Step(both);
    const std::vector<Vector3d> expected = VectorsOf(batch.reports.at(0));
    ASSERT_FALSE(expected.empty());
    EXPECT_EQ(VectorsOf(batch.reports.at(1)), expected);
    for (Backend* backend : {narrow.get(), in_parts.get()}) {
      const ClothHandle cloth = test::CreateCloth(*backend, scene);
      const StepItem item = Asking(cloth, scene);
      EXPECT_EQ(VectorsOf(backend->Step({&item, 1}).reports.at(0)), expected);
    }
    const StepItem item = Asking(test::CreateCloth(*in_parts, scene), scene);
    std::optional<BatchReport> done;
    uint32_t pieces = 0;
    for (; !done && pieces < 100'000; ++pieces) {
      done = in_parts->StepPiece({&item, 1}, Pause::At(std::chrono::steady_clock::now()));
    }
    ASSERT_TRUE(done.has_value());
    EXPECT_EQ(VectorsOf(done->reports.at(0)), expected) << pieces << " pieces";
  }
}

// The room for impulses is made within a step, and stays; others of the batch do not notice.
TEST(ImpulsesTest, WhoAsksAndWhoDoesNotMayTakeTurns) {
  const auto backend = MakeGlBackend();
  for (test::Scene scene : Scenes()) {
    const ClothHandle asked = test::CreateCloth(*backend, scene);
    const ClothHandle plain = test::CreateCloth(*backend, scene);
    for (uint32_t step = 0; step < 4; ++step) {
      std::vector<StepItem> items = {Asking(asked, scene), Asking(plain, scene)};
      items[0].impulses = step % 2 == 0;
      items[1].impulses = false;
      const BatchReport batch = backend->Step(items);
      EXPECT_EQ(batch.reports.at(0).impulses != nullptr, items[0].impulses);
      EXPECT_EQ(batch.reports.at(1).impulses, nullptr);
      ASSERT_EQ(ReadCloth(*backend, asked), ReadCloth(*backend, plain)) << "step " << step;
    }
  }
}

TEST(ImpulsesTest, WithoutRoomTheStepIsDoneAndTheyAreNotANumber) {
  // Arrays that are just large enough for the sheet.
  const test::Scene scene = Scenes()[1];
  std::unique_ptr<Backend> backend;
  Result<ClothHandle> created = Status(StatusCode::kResourceExhausted, "", "");
  for (int64_t bytes = 200'000; !created.ok() && bytes < 2'000'000; bytes += 50'000) {
    backend = MakeGlBackend({.max_array_bytes = bytes});
    created = backend->Create(scene.model, scene.parameters, scene.state);
  }
  ASSERT_TRUE(created.ok());
  const ClothHandle cloth = created.value();
  const StepItem item = Asking(cloth, scene);
  const StepReport report = backend->Step({&item, 1}).reports.at(0);
  EXPECT_EQ(report.fault, FaultReason::kNone);
  ASSERT_NE(report.impulses, nullptr);
  EXPECT_EQ(report.impulses->pins_n_s.size(), scene.model->pin_count());
  EXPECT_EQ(report.impulses->colliders.size(), scene.parameters.colliders.size());
  for (const auto& impulse : report.impulses->pins_n_s) EXPECT_TRUE(impulse.array().isNaN().all());
  for (const auto& of_collider : report.impulses->colliders) {
    EXPECT_TRUE(of_collider.impulse_n_s.array().isNaN().all());
    EXPECT_TRUE(of_collider.angular_impulse_n_m_s.array().isNaN().all());
  }
  ASSERT_TRUE(report.impulses->contacts.has_value());
  EXPECT_EQ(report.impulses->contacts->size(),
            scene.model->particle_count() * scene.parameters.colliders.size());
  for (const ParticleImpulse& contact : *report.impulses->contacts) {
    EXPECT_TRUE(contact.impulse_n_s.array().isNaN().all());
  }
  const auto roomy = MakeGlBackend();
  const ClothHandle other = test::CreateCloth(*roomy, scene);
  test::StepAlone(*roomy, other, scene);
  EXPECT_EQ(ReadCloth(*backend, cloth), ReadCloth(*roomy, other));
}

TEST(PullListsTest, EveryEndOfALinkIsThereOnce) {
  const test::Scene scene = test::JointedChain(6, 0.1, 0);
  const SceneModel& model = *scene.model;
  const std::vector<uint32_t> words = PackPullLists(model);
  const uint32_t particles = model.particle_count();
  const auto ends_of = [&](uint32_t vector) {
    std::vector<std::pair<uint32_t, bool>> ends;  // particle, whether it is the first one
    for (uint32_t i = 0; i < particles; ++i) {
      for (uint32_t k = words[i]; k < words[i + 1]; ++k) {
        const uint32_t entry = words[particles + 1 + k];
        if (entry >> 1 == vector) ends.emplace_back(i, (entry & 1) != 0);
      }
    }
    return ends;
  };
  uint32_t vector = 0;
  const auto expect_link = [&](uint32_t i, uint32_t j) {
    const auto ends = ends_of(vector++);
    ASSERT_EQ(ends.size(), 2u);
    for (const auto& [particle, is_first] : ends) EXPECT_EQ(particle, is_first ? i : j);
    EXPECT_NE(ends[0].second, ends[1].second);
  };
  for (const DistanceConstraint& constraint : model.constraints()) {
    expect_link(constraint.i, constraint.j);
  }
  for (const PointJoint& joint : model.joints()) expect_link(joint.i, joint.j);
  ASSERT_FALSE(model.tethers().empty());
  for (const Tether& tether : model.tethers()) {
    const auto ends = ends_of(vector++);
    ASSERT_EQ(ends.size(), 1u);
    EXPECT_EQ(ends[0], std::pair(tether.pin, false));
  }
  EXPECT_EQ(CountPullVectors(model), vector);
  EXPECT_EQ(words.size(), particles + 1 + words[particles]);
}

}  // namespace
}  // namespace drape
