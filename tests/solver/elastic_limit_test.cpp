#include "server/solver/elastic_limit.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/solver/load.h"
#include "server/solver/step_plan.h"
#include "tests/support/scenes.h"

namespace drape::test {
namespace {

bool IsBeyondLimit(const Scene& scene) {
  return PlanOf(scene).known_warnings.elastic_beyond_limit;
}

Scene Fabric(bool is_mesh, Preset preset, double rigidity_n_m) {
  const StructuralMaterial material{.bending_rigidity_n_m = rigidity_n_m,
                                    .shear_modulus_n_per_m = 20};
  Scene scene = is_mesh ? MeshedGrid(9, 9, 0.01, 0.01, {0, 8}, material)
                        : Grid(9, 9, 0.01, 0.01, {0, 8}, material);
  scene.parameters.settings = PresetSettings(preset);
  return scene;
}

// Whatever is requested: as few substeps as are told are enough, and ten per cent less are not.
TEST(ElasticLimit, TellsHowManySubstepsWouldDo) {
  int limited = 0;
  for (const bool is_mesh : {false, true}) {
    for (const Preset preset : {Preset::kRealtime, Preset::kAccurate, Preset::kPaper}) {
      for (const double rigidity_n_m : {1e-8, 1e-6, 1e-5, 3e-5, 1e-4, 1e-3}) {
        Scene scene = Fabric(is_mesh, preset, rigidity_n_m);
        const auto limit = ElasticLimitOf(*scene.model, scene.parameters);
        ASSERT_EQ(limit.has_value(), IsBeyondLimit(scene));
        if (!limit) continue;
        ++limited;
        EXPECT_GT(limit->elements, 0u);
        EXPECT_LE(limit->elements, scene.model->elastic_count());
        EXPECT_GT(limit->least_share, 0);
        EXPECT_LT(limit->least_share, 1);
        uint32_t& substeps = scene.parameters.settings.substeps;
        const uint32_t enough = limit->enough_substeps.value_or(kMaxSubsteps);
        substeps = enough;
        EXPECT_EQ(IsBeyondLimit(scene), !limit->enough_substeps.has_value()) << enough;
        substeps = static_cast<uint32_t>(0.9 * enough);
        EXPECT_TRUE(IsBeyondLimit(scene)) << enough;
      }
    }
  }
  EXPECT_GT(limited, 4);
}

// With the largest stiffness that it lets act a cloth is as stiff as it is now.
TEST(ElasticLimit, TellsTheShareThatActs) {
  Scene scene = Fabric(true, Preset::kPaper, 1e-4);
  const auto limit = ElasticLimitOf(*scene.model, scene.parameters);
  ASSERT_TRUE(limit.has_value());
  const double most_per_s2 = PlanOf(scene).max_elastic_frequency_sq_per_s2;
  const auto& all = scene.model->elastic_shares().frequencies_sq_per_s2;
  EXPECT_DOUBLE_EQ(limit->least_share, most_per_s2 / *std::ranges::max_element(all));
  EXPECT_EQ(limit->elements,
            std::ranges::count_if(all, [&](double its) { return its > most_per_s2; }));
}

// What the load of a heavy cloth adds to the substeps counts: its steps have them.
TEST(ElasticLimit, KnowsTheSubstepsOfHeavyCloths) {
  int raised = 0, limited = 0;
  for (const double density_kg_per_m2 : {1.0, 100.0, 1e4}) {
    for (const double rigidity_n_m : {1e-7, 1e-4, 1e-1, 100.0, 1e4}) {
      const StructuralMaterial material{.areal_density_kg_per_m2 = density_kg_per_m2,
                                        .bending_rigidity_n_m = rigidity_n_m};
      Scene scene = Grid(40, 40, 2, 2, {0, 39}, material);
      scene.parameters.settings = PresetSettings(Preset::kRealtime);
      scene.parameters.settings.substeps = 4;
      const auto limit = ElasticLimitOf(*scene.model, scene.parameters);
      scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
      raised += scene.parameters.settings.substeps > 4;
      limited += limit.has_value();
      EXPECT_EQ(limit.has_value(), IsBeyondLimit(scene)) << rigidity_n_m;
      if (!limit || !limit->enough_substeps) continue;
      scene.parameters.settings.substeps = *limit->enough_substeps;
      EXPECT_FALSE(IsBeyondLimit(scene)) << rigidity_n_m;
    }
  }
  EXPECT_GT(raised, 0);
  EXPECT_GT(limited, 0);
}

TEST(ElasticLimit, NothingIsLimitedWhereNothingBends) {
  const Scene scene = Grid(5, 5, 1, 1);
  EXPECT_FALSE(ElasticLimitOf(*scene.model, scene.parameters).has_value());
}

}  // namespace
}  // namespace drape::test
