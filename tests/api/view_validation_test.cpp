#include "server/api/view_validation.h"

#include <memory>
#include <vector>

#include "tests/api/bad_cases.h"
#include "tests/scheduler/fake_backend.h"

namespace drape::api {
namespace {

using test::ExpectViolation;

// Cloths of these numbers of particles, with the slot as id.
std::shared_ptr<ClothRecord> Cloth(uint32_t slot, uint32_t particles) {
  auto description = std::make_shared<ClothDescription>();
  description->model = ChainModel(particles);
  auto record = std::make_shared<ClothRecord>(Placement(), RigidTransform(), description);
  record->id = ClothId{slot, 0};
  return record;
}

Status Check(std::vector<uint32_t> particles, const ClothList& cloths) {
  const StateFields fields{.positions = true, .particles = std::move(particles)};
  return CheckClothsHaveParticles(FieldPath("view"), fields, cloths);
}

TEST(ViewValidation, ListsAreLimited) {
  v1::StateView view;
  for (uint32_t p = 0; p < 4096; ++p) view.add_particles(p);
  Violations violations;
  EXPECT_EQ(CheckView(FieldPath("view"), view, violations).particles.size(), 4096u);
  EXPECT_TRUE(violations.is_empty());
  view.add_particles(4096);
  CheckView(FieldPath("view"), view, violations);
  ExpectViolation(violations.ToStatus(), "view.particles", "names 4097 particles, at most 4096");
}

TEST(ViewValidation, EveryClothNeedsEveryParticle) {
  const ClothList cloths{Cloth(3, 9), Cloth(5, 4), Cloth(8, 12)};
  EXPECT_TRUE(Check({0, 3}, cloths).ok());
  EXPECT_TRUE(Check({}, cloths).ok());
  EXPECT_TRUE(Check({0, 8}, {cloths[0], cloths[2]}).ok());
  EXPECT_TRUE(Check({1000}, {}).ok()) << "a session without cloths";
  const Status status = Check({0, 3, 4, 8}, cloths);
  ExpectViolation(status, "view.particles[2]", "4 is not in [0, 3], the particles of cloth 5");
  ExpectViolation(status, "view.particles[3]", "8 is not in [0, 3]");
  EXPECT_EQ(status.violations().size(), 2u);
}

// The whole list would not fit into an answer.
TEST(ViewValidation, ALongListOfStrangersIsNamedInPart) {
  std::vector<uint32_t> particles(4000);
  for (uint32_t k = 0; k < particles.size(); ++k) particles[k] = 10 + k;
  EXPECT_EQ(Check(particles, {Cloth(1, 4)}).violations().size(), Violations::kMaxCount);
  v1::StateView view;
  for (const uint32_t particle : particles) view.add_particles(particles.back() - particle);
  Violations violations;
  CheckView(FieldPath("view"), view, violations);
  EXPECT_EQ(violations.count(), Violations::kMaxCount);
}

}  // namespace
}  // namespace drape::api
