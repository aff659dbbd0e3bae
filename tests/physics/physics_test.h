// Shared by the physics tests: one body over every backend, and its round-off.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {

// Functions of every fixture here. Destroys the cloths that it made.
class PhysicsBase : public ::testing::Test {
 protected:
  void TearDown() override {
    for (const ClothHandle cloth : cloths_) backend().Destroy(cloth);
  }

  virtual std::string backend_name() const = 0;

  Backend& backend() { return SharedBackend(backend_name()); }
  // Largest relative error of one rounded operation.
  double round_off() { return UnitRoundOff(backend()); }
  ScalarType scalar() { return backend().Describe().scalar; }

  ClothHandle Make(const Scene& scene) {
    cloths_.push_back(CreateCloth(backend(), scene));
    return cloths_.back();
  }
  // The state of a new cloth after `steps` steps.
  ParticleState StateAfter(const Scene& scene, uint32_t steps = 1) {
    const ClothHandle cloth = Make(scene);
    StepAlone(backend(), cloth, scene, steps);
    return ReadState(backend(), cloth);
  }

 private:
  std::vector<ClothHandle> cloths_;
};

// Parameter: a backend's name.
class PhysicsTest : public PhysicsBase, public ::testing::WithParamInterface<std::string> {
 protected:
  std::string backend_name() const override { return GetParam(); }
};

// One substep per step, this many sweeps over the colours, no tolerance.
inline StepSettings SingleSubstep(double time_step_s, uint32_t max_iterations = 1) {
  StepSettings settings = PlainSettings();
  settings.time_step_s = time_step_s;
  settings.substeps = 1;
  settings.max_iterations = max_iterations;
  settings.tolerance = 0;
  settings.integration = Integration::kOneStep;
  settings.direction = Direction::kAtEnd;
  settings.sweep = Sweep::kColours;
  return settings;
}

inline Scene LoneParticle(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) {
  Scene scene = Particles(
      {.positions_m = {position}, .masses_kg = {0.125}, .distance_constraints = {}, .springs = {}});
  scene.state.velocities_m_per_s = {velocity};
  return scene;
}

#define DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(suite)                               \
  INSTANTIATE_TEST_SUITE_P(Backends, suite, ::testing::ValuesIn(BackendNames()), \
                           [](const auto& case_info) { return std::string(case_info.param); })

}  // namespace drape::test
