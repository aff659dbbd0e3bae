// What fabrics and garments cost, against the bare sheet -> speed_fabrics.csv.
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/speed/speed.h"
#include "tests/bench/speed/turns.h"
#include "tests/support/backends/backends.h"
#include "tests/support/garments.h"

namespace drape::bench {
namespace {

struct FabricCloth {
  std::string name;
  test::Scene scene;
};

test::Scene AtRealtime(test::Scene scene) {
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  scene.parameters.settings.sleep_motion_m = 0;
  return scene;
}

// Of cotton shirting, 1 m x 1 m, by two corners.
FabricCloth FabricSheet(const std::string& name, uint32_t side, double rigidity_n_m,
                        double modulus_n_per_m) {
  return {name, AtRealtime(test::Grid(side, side, 1, 1, {0, side - 1},
                                      {.areal_density_kg_per_m2 = 0.12,
                                       .bending_rigidity_n_m = rigidity_n_m,
                                       .shear_modulus_n_per_m = modulus_n_per_m}))};
}

// The first is what the others are compared with.
std::vector<FabricCloth> FabricCloths(uint32_t side, double cell_m) {
  constexpr double kRigidity_n_m = 1e-5, kModulus_n_per_m = 40;
  std::vector<FabricCloth> cloths = {
      FabricSheet("bare sheet", side, 0, 0),
      FabricSheet("sheet that bends", side, kRigidity_n_m, 0),
      FabricSheet("sheet that shears", side, 0, kModulus_n_per_m),
      FabricSheet("sheet that does both", side, kRigidity_n_m, kModulus_n_per_m)};
  for (const double rigidity_n_m : {0.0, kRigidity_n_m}) {
    for (const test::Scene& scene :
         test::Garments({.cell_m = cell_m, .bending_rigidity_n_m = rigidity_n_m})) {
      const std::string name = "irregular " + scene.name + (rigidity_n_m > 0 ? " that bends" : "");
      cloths.push_back({name, AtRealtime(scene)});
    }
  }
  return cloths;
}

}  // namespace

void MeasureFabrics(Bench& bench, FabricsOptions options) {
  if (bench.is_quick()) {
    options = {.counts = {1, 4}, .side = 6, .cell_m = 0.2, .rounds = 1, .turn_s = 0};
  }
  Table table = bench.OpenTable("speed_fabrics", {"cloth", "particles", "cloths", "round", "ms",
                                                  "bare_ms", "bare_particles"});
  const std::vector<FabricCloth> cloths = FabricCloths(options.side, options.cell_m);
  for (const uint32_t count : options.counts) {
    if (!bench.StartRow(std::to_string(count) + " cloths of fabric")) return;
    std::vector<TurnTaker> takers;
    for (const FabricCloth& cloth : cloths) {
      takers.emplace_back(test::MakeBackend("cpu"), cloth.scene, count);
      takers.back().Turn_ms(options.lead_s);
    }
    for (uint32_t round = 1; round <= options.rounds; ++round) {
      double bare_ms = 0;
      for (size_t k = 0; k < cloths.size(); ++k) {
        const double ms = takers[k].Turn_ms(options.turn_s);
        if (k == 0) bare_ms = ms;
        table.Add({cloths[k].name, takers[k].particles(), count, round, ms, bare_ms,
                   takers[0].particles()});
      }
    }
  }
}

}  // namespace drape::bench
