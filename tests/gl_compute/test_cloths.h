// Small cloths for the tests of this folder.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/gl_tuning.h"
#include "tests/support/plain_settings.h"

namespace drape {

// On the software renderer if there is no hardware; aborts the test binary without any.
inline std::unique_ptr<Backend> MakeGlBackend(const GlTuning& tuning = {},
                                              const GlBackendOptions& options = {}) {
  Result<std::unique_ptr<Backend>> backend = CreateTunedGlBackend(options, tuning);
  DRAPE_CHECK(backend.ok(), backend.status().ToString());
  return std::move(backend).value();
}

inline std::shared_ptr<const SceneModel> BuildModel(const ModelDescription& description) {
  Result<std::shared_ptr<const SceneModel>> model = SceneModel::Build(description);
  DRAPE_CHECK(model.ok(), model.status().ToString());
  return std::move(model).value();
}

// 1 m x 1 m, density 0.2 kg/m2.
inline ModelDescription GridDescription(uint32_t columns, uint32_t rows,
                                        std::vector<uint32_t> pins = {}) {
  return {.topology = GridTopology{.columns = columns, .rows = rows, .width_m = 1, .height_m = 1},
          .material = {},
          .pinned_particles = std::move(pins)};
}

inline std::shared_ptr<const SceneModel> GridModel(uint32_t columns, uint32_t rows,
                                                   std::vector<uint32_t> pins = {}) {
  return BuildModel(GridDescription(columns, rows, std::move(pins)));
}

// A chain of `count` particles of 0.01 kg along +x, 0.02 m apart, in SI units.
inline ModelDescription ChainDescription(uint32_t count, std::vector<uint32_t> pins = {}) {
  ParticleTopology chain;
  for (uint32_t i = 0; i < count; ++i) {
    chain.positions_m.push_back({0.02 * i, 0, 0});
    chain.masses_kg.push_back(0.01);
    if (i > 0) chain.distance_constraints.push_back({i - 1, i, 0.02, 0});
  }
  return {.topology = chain, .material = {}, .pinned_particles = std::move(pins)};
}

inline ParticleState AtRest(const SceneModel& model) {
  const auto rest = model.rest_positions_m();
  return {.positions_m = {rest.begin(), rest.end()},
          .velocities_m_per_s = std::vector<Eigen::Vector3d>(rest.size(), Eigen::Vector3d::Zero())};
}

inline ClothHandle CreateCloth(Backend& backend, const std::shared_ptr<const SceneModel>& model,
                               const ClothParameters& parameters, const ParticleState& state) {
  const Result<ClothHandle> cloth = backend.Create(model, parameters, state);
  DRAPE_CHECK(cloth.ok(), cloth.status().ToString());
  return cloth.value();
}

inline ClothHandle CreateCloth(Backend& backend, const std::shared_ptr<const SceneModel>& model,
                               const ClothParameters& parameters = test::PlainParameters()) {
  return CreateCloth(backend, model, parameters, AtRest(*model));
}

// Positions, then velocities, of one cloth; each packed x, y, z.
inline std::vector<float> ReadCloth(Backend& backend, ClothHandle cloth) {
  const StateColumns columns = backend.Read({std::span(&cloth, 1), true, true});
  std::vector<float> both = std::get<std::vector<float>>(columns.positions_m);
  const auto& velocities = std::get<std::vector<float>>(columns.velocities_m_per_s);
  both.insert(both.end(), velocities.begin(), velocities.end());
  return both;
}

inline StepReport StepCloth(Backend& backend, ClothHandle cloth, bool measure = false) {
  const StepItem item{.cloth = cloth, .pin_targets_m = {}, .measure = measure};
  return backend.Step(std::span(&item, 1)).reports.at(0);
}

// Expects the same bits however long steps are cut into dispatches. `sweeps`: the number of sweeps
// of a step. llvmpipe leaves every loop after 65535 passes in one invocation, without an error.
inline void ExpectCutsChangeNothing(GlTuning tuning, const std::shared_ptr<const SceneModel>& model,
                                    const ClothParameters& parameters, uint32_t sweeps) {
  std::vector<std::vector<float>> states;
  for (const bool is_cautious : {false, true}) {
    if (is_cautious) tuning.loop_budget = 5000;
    const std::unique_ptr<Backend> backend = MakeGlBackend(tuning);
    const ClothHandle cloth = CreateCloth(*backend, model, parameters);
    EXPECT_EQ(StepCloth(*backend, cloth).iterations, sweeps);
    states.push_back(ReadCloth(*backend, cloth));
  }
  EXPECT_EQ(states[0], states[1]);
}

}  // namespace drape
