#include "server/api/view_validation.h"

#include <cmath>
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
  const ViewSpec view{.fields = {.positions = true, .particles = std::move(particles)}};
  return CheckViewFits(FieldPath("view"), view, cloths);
}

TEST(ViewValidation, ListsAreLimited) {
  v1::StateView view;
  for (uint32_t p = 0; p < 4096; ++p) view.add_particles(p);
  Violations violations;
  EXPECT_EQ(CheckView(FieldPath("view"), view, violations).fields.particles.size(), 4096u);
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

Status CheckOf(const v1::StateView& view) {
  Violations violations;
  CheckView(FieldPath("view"), view, violations);
  return violations.ToStatus();
}

// One particle at `x`.
v1::StateView TargetAt(float x) {
  const float target[] = {x, 0, 0};
  v1::StateView view;
  view.add_reductions(v1::StateView::TARGET_DISTANCE);
  view.mutable_target_m()->set_data_type(v1::PackedArray::FLOAT32);
  view.mutable_target_m()->add_shape(1);
  view.mutable_target_m()->add_shape(3);
  view.mutable_target_m()->set_data(target, sizeof(target));
  return view;
}

TEST(ViewValidation, ReductionsTakeThePlaceOfPositions) {
  v1::StateView view;
  view.add_reductions(v1::StateView::BOX);
  view.add_particles(3);
  Violations violations;
  ViewSpec spec = CheckView(FieldPath("view"), view, violations);
  EXPECT_FALSE(spec.fields.any());
  EXPECT_TRUE(spec.any());
  EXPECT_EQ(spec.FieldsRead(), (StateFields{true, false, {}}));
  view.set_velocities(true);
  spec = CheckView(FieldPath("view"), view, violations);
  EXPECT_EQ(spec.fields, (StateFields{false, true, {3}}));
  EXPECT_EQ(spec.FieldsRead(), (StateFields{true, true, {}})) << "a part of them is sent";
  view.clear_reductions();
  spec = CheckView(FieldPath("view"), view, violations);
  EXPECT_EQ(spec.FieldsRead(), spec.fields);
  EXPECT_TRUE(violations.is_empty());
}

TEST(ViewValidation, PartsOfReductionsBelongTogether) {
  v1::StateView view;
  view.set_coverage_radius_m(0.1);
  ExpectViolation(CheckOf(view), "view.coverage_radius_m", "COVERAGE is not asked for");
  view.add_reductions(v1::StateView::COVERAGE);
  EXPECT_TRUE(CheckOf(view).ok());
  for (const double radius_m : {0.0, -1.0, 1e7, std::nan("")}) {
    view.set_coverage_radius_m(radius_m);
    ExpectViolation(CheckOf(view), "view.coverage_radius_m", "is not in (0, 1e+06] m");
  }
  view.set_coverage_radius_m(1);
  view.add_reductions(v1::StateView::COVERAGE);
  ExpectViolation(CheckOf(view), "view.reductions[1]", "there already");
  view.set_reductions(1, v1::StateView::REDUCTION_UNSPECIFIED);
  ExpectViolation(CheckOf(view), "view.reductions[1]", "names no reduction");
  view.set_reductions(1, static_cast<v1::StateView::Reduction>(77));
  ExpectViolation(CheckOf(view), "view.reductions[1]", "77");
  view.clear_reductions();
  view.clear_coverage_radius_m();
  view.set_encoding(static_cast<v1::StateView::Encoding>(9));
  ExpectViolation(CheckOf(view), "view.encoding", "9");
}

TEST(ViewValidation, ATargetIsAPlacePerParticle) {
  v1::StateView view = TargetAt(2);
  EXPECT_TRUE(CheckOf(view).ok());
  view.clear_reductions();
  ExpectViolation(CheckOf(view), "view.target_m", "TARGET_DISTANCE is not asked for");
  ExpectViolation(CheckOf(TargetAt(INFINITY)), "view.target_m[0]", "inf, 0, 0 are not within");
  view = TargetAt(1);
  view.clear_target_m();
  ExpectViolation(CheckOf(view), "view.target_m.data_type", "is not FLOAT32 or FLOAT64");
  view = TargetAt(1);
  view.mutable_target_m()->set_data_type(v1::PackedArray::FLOAT16);
  ExpectViolation(CheckOf(view), "view.target_m.data_type", "FLOAT16 is not");
  Violations violations;
  const ViewSpec spec = CheckView(FieldPath("view"), TargetAt(1), violations);
  EXPECT_TRUE(CheckViewFits(FieldPath("view"), spec, {Cloth(1, 1)}).ok());
  ExpectViolation(CheckViewFits(FieldPath("view"), spec, {Cloth(1, 1), Cloth(5, 4)}),
                  "view.target_m.shape", "is of 1 particles, cloth 5 has 4");
}

}  // namespace
}  // namespace drape::api
