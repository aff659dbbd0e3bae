#include "server/api/step_cost.h"

#include "tests/api/bad_cases.h"
#include "tests/support/plain_settings.h"

namespace drape::api {
namespace {

using test::ExpectViolation;

// 32 x 32 particles: about 3000 solves per sweep, above the limit at 10000 x 10000 sweeps.
ClothDescription Sheet() {
  ModelDescription description;
  description.topology = GridTopology{.columns = 32, .rows = 32, .width_m = 1, .height_m = 1};
  ClothDescription cloth;
  cloth.model = SceneModel::Build(description).value();
  return cloth;
}

StepSettings Sweeps(uint32_t substeps, uint32_t max_iterations) {
  StepSettings settings = test::PlainSettings();
  settings.substeps = substeps;
  settings.max_iterations = max_iterations;
  return settings;
}

TEST(StepCost, NamesTheFieldTheValueTheLimitAndTheWayOut) {
  const ClothDescription cloth = Sheet();
  EXPECT_TRUE(CheckStepCost("spec.settings", *cloth.model, Sweeps(60, 100), 256).ok());
  const Status status =
      CheckStepCost("overrides[3].settings", *cloth.model, Sweeps(10000, 10000), 0);
  ExpectViolation(status, "overrides[3].settings", "at most 2e+10");
  ExpectViolation(status, "overrides[3].settings", "lower substeps, max_iterations");
}

TEST(StepCost, ParticlesTimesCollidersAreBounded) {
  const ClothDescription cloth = Sheet();
  EXPECT_TRUE(CheckStepCost("spec.settings", *cloth.model, Sweeps(1, 1), 16384).ok());
  ExpectViolation(CheckStepCost("spec.settings", *cloth.model, Sweeps(1, 1), 16385),
                  "spec.environment.colliders", "at most 16777216");
}

TEST(StepCost, AChangeCountsWithWhatStays) {
  ClothDescription cloth = Sheet();
  cloth.parameters.settings = Sweeps(1000, 5000);
  ClothChange change;
  EXPECT_TRUE(CheckStepCost(cloth, change).ok());
  change.colliders.emplace(10);
  ExpectViolation(CheckStepCost(cloth, change), "spec.settings", "number of colliders");
  change.settings = Sweeps(10, 10);
  EXPECT_TRUE(CheckStepCost(cloth, change).ok());
}

}  // namespace
}  // namespace drape::api
